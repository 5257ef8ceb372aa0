//! What finds numbers of samples that no vertex has.

use super::trace::Hit;
use crate::model::fields::Field;

/// What finds a field of samples at any point of the mesh.
pub(super) trait Supply: Sync {
    /// The field's numbers there.
    fn find(&self, hit: Hit, numbers: &mut [f32]);
}

/// Fields, and what finds each.
pub(super) type Supplies<'a> = Vec<(Field, Box<dyn Supply + 'a>)>;
