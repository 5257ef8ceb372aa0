//! The objective as `argmin`'s own solvers see it: a cost and a gradient of free variables.

use std::cell::RefCell;

use argmin::core::{CostFunction, Error, Gradient};

use super::linearisation::Passes;
use super::transform::Transform;

/// A cost of free variables.
///
/// `argmin` asks for the cost and then for the gradient of the same point: with `with_gradient` the
/// pass that answers the first answers both.
pub struct Unbounded<'a> {
    passes: &'a Passes<'a>,
    transform: &'a Transform,
    with_gradient: bool,
    last: RefCell<Option<Evaluation>>,
}

#[derive(Clone)]
struct Evaluation {
    variables: Vec<f64>,
    loss: f64,
    gradient: Vec<f64>,
}

impl<'a> Unbounded<'a> {
    /// The cost of `transform`'s variables.
    #[must_use]
    pub fn new(passes: &'a Passes<'a>, transform: &'a Transform, with_gradient: bool) -> Self {
        Self { passes, transform, with_gradient, last: RefCell::new(None) }
    }

    fn evaluate(&self, variables: &[f64]) -> Result<Evaluation, Error> {
        if let Some(last) = self.last.borrow().as_ref().filter(|last| last.variables == variables) {
            return Ok(last.clone());
        }
        let (loss, gradient) = self.passes.gradient(&self.transform.coordinates(variables));
        let gradient = self.transform.pull_back(variables, &gradient);
        // A line search that meets NaN would look for its end for ever.
        if !loss.is_finite() || gradient.iter().any(|g| !g.is_finite()) {
            return Err(Error::msg("the loss is not finite there"));
        }
        let evaluation = Evaluation { variables: variables.to_vec(), loss, gradient };
        *self.last.borrow_mut() = Some(evaluation.clone());
        Ok(evaluation)
    }
}

impl CostFunction for Unbounded<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, variables: &Vec<f64>) -> Result<f64, Error> {
        if self.with_gradient {
            return Ok(self.evaluate(variables)?.loss);
        }
        // A simplex turns away from infinity by itself.
        let loss = self.passes.loss(&self.transform.coordinates(variables));
        Ok(if loss.is_finite() { loss } else { f64::INFINITY })
    }
}

impl Gradient for Unbounded<'_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, variables: &Vec<f64>) -> Result<Vec<f64>, Error> {
        Ok(self.evaluate(variables)?.gradient)
    }
}
