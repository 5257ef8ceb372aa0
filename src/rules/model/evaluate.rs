//! What is evaluated.

use super::choices::{
    Bounces, Choices, LobeLookup, NormalFilter, SkinReflection, SpecularMap, SpecularModel,
    SpecularVisibility, SplitSum, Visibility,
};
use super::dapple::Dapple;
use super::diffusion::DiffusionChoices;
use super::effects::{Effect, Effects, Form, Lookups, Silhouette};
use super::transmission::{Method, TransmissionChoices};

/// The switches that are the same for every fragment of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Setup {
    /// Which reading of the listings.
    pub form: Form,
    /// Where S.z comes from.
    pub silhouette: Silhouette,
    /// What is switched on.
    pub effects: Effects,
    /// Along which normal the cubes are looked up.
    pub lookups: Lookups,
    /// Where light falls through leaves from.
    pub dapple: Dapple,
    /// Whether it is the rim, S.y, that is interpolated from vertices (listing 3-3), and not S.z, whose power is then
    /// taken where the fragment is. Of a lone fragment there is nothing to interpolate. Read where the silhouette is
    /// [`Silhouette::Vertex`].
    pub interpolated_rim: bool,
    /// Which ways are taken where there are several.
    pub choices: Choices,
}

impl Setup {
    /// The three switches that every scene has; the others are as the first version has them.
    #[must_use]
    pub const fn new(form: Form, silhouette: Silhouette, effects: Effects) -> Self {
        Self {
            form,
            silhouette,
            effects,
            lookups: Lookups::Bumped,
            dapple: Dapple::LEAVES_AHEAD,
            interpolated_rim: false,
            choices: Choices {
                specular_model: SpecularModel::Kelemen,
                split_sum: SplitSum::Schlick,
                specular_visibility: SpecularVisibility::Lagarde,
                lobe_lookup: LobeLookup::Mirror,
                specular_map: SpecularMap::Weight,
                normal_filter: NormalFilter::None,
                visibility: Visibility::Sh4,
                bounces: Bounces::Gathered,
                skin_reflection: SkinReflection::Gathered,
                diffusion: DiffusionChoices::DEFAULT,
                transmission: TransmissionChoices { method: Method::Thickness },
                glossy: false,
                turning: false,
            },
        }
    }

    /// Whether anything sees the bumped normal. With smooth lookups the key light and a bumped silhouette do, and rules
    /// that were added may.
    #[must_use]
    pub fn bumps(&self) -> bool {
        let seen = self.effects.has(Effect::KeyLight)
            || self.silhouette == Silhouette::Bumped
            || self.effects.added().next().is_some();
        self.effects.has(Effect::NormalMap) && (self.lookups == Lookups::Bumped || seen)
    }

    /// Whether the cubes are looked up along another normal than n. Where nothing bends n it is the smooth normal, but
    /// in the listing, whose n is as long as it was interpolated.
    #[must_use]
    pub fn smooth_lookups(&self) -> bool {
        self.lookups == Lookups::Smooth && (self.bumps() || self.form == Form::Listing)
    }

    /// Whether the rim is made at a triangle's corners.
    #[must_use]
    pub fn rim_of_corners(&self) -> bool {
        self.interpolated_rim && self.silhouette == Silhouette::Vertex
    }
}
