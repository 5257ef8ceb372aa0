//! The model itself as an evaluator: in f64, the reference, and in f32.

use std::marker::PhantomData;

use super::case::{Batch, FragmentInputs, VertexInputs};
use super::evaluate::{Answer, Evaluator, Frame, Scalar};
use super::lights::LightBox;
use super::rules::Rules;
use crate::engine::cubes_at::CubesAt;
use crate::model::vertex::deform;

/// The model, one fragment after the other.
#[derive(Debug, Default)]
pub struct Plain<R>(PhantomData<R>);

impl<R: Scalar> Plain<R> {
    /// The model in that scalar.
    #[must_use]
    pub const fn new() -> Self {
        Self(PhantomData)
    }
}

impl<R: Scalar> Evaluator for Plain<R>
where
    R::Texel: Send + Sync,
{
    fn name(&self) -> String {
        R::NAME.to_owned()
    }

    fn fragments(&self, lights: &LightBox, batch: &Batch) -> Result<Answer, String> {
        let setting = &batch.setting;
        let light = lights.of(setting.lights);
        let rules = Rules::of(setting.setup, light).map_err(|error| error.to_string())?;
        let cubes = CubesAt::new(light, &setting.params, R::texel);
        let at = rules.at(&setting.params, &cubes);
        let each = |inputs: &FragmentInputs| {
            let f = inputs.fragment(setting.setup, R::ZERO);
            let shaded = rules.shaded(&at, &f, &rules.shading(&at, &f));
            (shaded.rgba, shaded.slopes)
        };
        let (values, slopes) = batch.fragments.iter().map(each).unzip();
        Ok(Answer { values: Some(values), slopes: Some(slopes), sums: None })
    }

    fn frames(&self, vertices: &[VertexInputs]) -> Result<Option<Vec<Frame>>, String> {
        let frame = |inputs: &VertexInputs| {
            let surface = deform(&inputs.vertex(R::ZERO), [], []);
            let parts = [surface.normal, surface.tangent, surface.bitangent];
            let mut numbers = parts.into_iter().flatten().map(R::wide);
            std::array::from_fn(|_| numbers.next().unwrap_or(f64::NAN))
        };
        Ok(Some(vertices.iter().map(frame).collect()))
    }
}
