//! The planned rules for single fragments, cut where the shading normal stands: what an f32 rounds there can be put in.

use std::sync::{Arc, Mutex, PoisonError};

use super::evaluate::{Rgba, Scalar, Slopes};
use crate::bake::Illumination;
use crate::engine::cubes_at::CubesAt;
use crate::engine::rules::sample_facts;
use crate::model::effects::Silhouette;
use crate::model::evaluate::Setup;
use crate::model::fragment::Fragment;
use crate::model::params::{Param, Params};
use crate::model::vector::V3;
use crate::program::graph::{Id, Input};
use crate::program::lower::Natives;
use crate::program::shading::{self, Quantities, ShadingError, constant};
use crate::program::steps::{self, Rounding, Steps};
use crate::shader::Facts;
use crate::shader::tangent::chain::Seed;

/// The shading normal of a fragment and what follows from it.
#[derive(Clone, Copy, Debug)]
pub struct Shading<R> {
    /// n
    pub n: V3<R>,
    /// The reflection vector.
    pub reflection: V3<R>,
    /// S.z
    pub silhouette: R,
    /// d n / d normal_strength.
    pub n_tangent: V3<R>,
    /// d reflection / d normal_strength.
    pub reflection_tangent: V3<R>,
    /// d S.z / d normal_strength.
    pub silhouette_tangent: R,
}

impl<R: Scalar> Shading<R> {
    /// Of what does not move, at a silhouette.
    const fn still(silhouette: R) -> Self {
        let zero = [R::ZERO; 3];
        Self {
            n: zero,
            reflection: zero,
            silhouette,
            n_tangent: zero,
            reflection_tangent: zero,
            silhouette_tangent: R::ZERO,
        }
    }

    /// The numbers of a part.
    fn part(&mut self, part: Part) -> &mut [R] {
        match part {
            Part::Normal => &mut self.n,
            Part::Reflection => &mut self.reflection,
            Part::Silhouette => std::slice::from_mut(&mut self.silhouette),
            Part::NormalTangent => &mut self.n_tangent,
            Part::ReflectionTangent => &mut self.reflection_tangent,
            Part::SilhouetteTangent => std::slice::from_mut(&mut self.silhouette_tangent),
        }
    }
}

/// A member of [`Shading`].
#[derive(Clone, Copy, Debug)]
enum Part {
    Normal,
    Reflection,
    Silhouette,
    NormalTangent,
    ReflectionTangent,
    SilhouetteTangent,
}

/// A shaded fragment.
#[derive(Clone, Debug)]
pub struct Shaded {
    /// Its colour.
    pub rgba: Rgba,
    /// Its derivatives by every parameter that its effects read.
    pub slopes: Slopes,
    /// For each colour the sum of its parts' sizes; 0 of the haze.
    pub summands: Rgba,
}

/// The rules of a setup for single fragments, cut where [`Shading`] stands between them.
#[derive(Debug)]
pub struct Rules {
    /// Up to there.
    shading: Steps,
    /// From there on: the value, how it moves with each of `free`, and the parts.
    light: Steps,
    /// The numbers at the cut, which `light` reads as components of [`CUT`].
    cut: Vec<(Part, usize)>,
    free: Vec<Param>,
}

/// The name under which numbers at the cut are read.
const CUT: &str = "cut";

/// What all fragments of a setting share, on both sides of the cut.
pub struct At<'a, R: Scalar>([steps::Setting<'a, R>; 2]);

impl Rules {
    /// The rules of a setup, for cubes of the sizes of `light`'s. They are made once.
    ///
    /// # Errors
    /// When no rules yield what the effects call for, or one of them cannot be computed on the processor.
    pub fn of(setup: Setup, light: &Illumination) -> Result<Arc<Self>, ShadingError> {
        static KNOWN: Mutex<Vec<(Facts, Arc<Rules>)>> = Mutex::new(Vec::new());
        // The environment's turn is always computed, as it may be free.
        let facts = sample_facts(setup, light, true);
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, rules)) = known.iter().find(|(of, _)| *of == facts) {
            return Ok(Arc::clone(rules));
        }
        let rules = Arc::new(Self::new(&facts)?);
        known.push((facts, Arc::clone(&rules)));
        Ok(rules)
    }

    fn new(facts: &Facts) -> Result<Self, ShadingError> {
        let asked = |param: &Param| param.asked_for(facts.setup.effects);
        let free: Vec<Param> = Param::built_in().filter(asked).collect();
        let seeds: Vec<Seed> = free.iter().map(|&param| Seed::of_param(param)).collect();
        let all = shading::Shading::new(facts, &seeds, |_| None, Natives::Written)?;
        let none = Quantities::new();
        let bumped = free.iter().position(|&param| param == Param::NormalStrength);
        let moved = bumped.map_or(&none, |seed| &all.moved[seed]);
        let found = facts.setup.silhouette == Silhouette::Bumped;
        let at_cut = [
            (Part::Normal, all.quantities.get("n")),
            (Part::Reflection, all.quantities.get("reflected")),
            (Part::Silhouette, all.quantities.get("silhouette").filter(|_| found)),
            (Part::NormalTangent, moved.get("n")),
            (Part::ReflectionTangent, moved.get("reflected")),
            (Part::SilhouetteTangent, moved.get("silhouette").filter(|_| found)),
        ];
        let (mut cut, mut ids): (Vec<(Part, usize)>, Vec<Id>) = (Vec::new(), Vec::new());
        for (part, numbers) in at_cut {
            for (component, &id) in numbers.into_iter().flatten().enumerate() {
                if all.graph.value(id).is_none() {
                    cut.push((part, component));
                    ids.push(id);
                }
            }
        }
        let parts = all.quantities.iter().filter(|(name, _)| name.ends_with("_part"));
        let parts: Vec<Id> = parts.flat_map(|(_, numbers)| numbers.iter().copied()).collect();
        let outputs = [&[all.value], &all.tangents[..]].concat().concat();
        let place = |id: Id| ids.iter().position(|&cut| cut == id);
        let instead = |id: Id| place(id).map(|component| Input { name: CUT.to_owned(), component });
        let (rest, outputs) = all.graph.rebuilt(&[outputs, parts].concat(), instead);
        Ok(Self {
            shading: Steps::new(&all.graph, &ids, |_| Rounding::Plain),
            light: Steps::new(&rest, &outputs, |_| Rounding::Plain),
            cut,
            free,
        })
    }

    /// What is the same for all fragments at `params`.
    #[must_use]
    pub fn at<'a, R: Scalar>(&self, params: &Params, cubes: &'a CubesAt<R::Texel>) -> At<'a, R> {
        let value = |input: &Input| constant(input, params).unwrap_or(0.0);
        At([&self.shading, &self.light].map(|steps| steps.setting(R::ZERO, value, |name| cubes.named(name))))
    }

    /// The shading normal of a fragment and what follows from it.
    #[must_use]
    pub fn shading<R: Scalar>(&self, at: &At<'_, R>, f: &Fragment<R>) -> Shading<R> {
        let mut shading = Shading::still(f.silhouette);
        let mut registers = Vec::new();
        let fields = self.shading.fields();
        self.shading.run(&at.0[0], R::ZERO, &mut registers, |place| field(f, &fields[place]));
        let found = self.shading.outputs(&at.0[0], &registers);
        for (&(part, component), number) in self.cut.iter().zip(found) {
            shading.part(part)[component] = number;
        }
        shading
    }

    /// A fragment from its shading normal on.
    #[must_use]
    pub fn shaded<R: Scalar>(&self, at: &At<'_, R>, f: &Fragment<R>, shading: &Shading<R>) -> Shaded {
        let (mut shading, mut registers) = (*shading, Vec::new());
        let cut: Vec<R> = self.cut.iter().map(|&(part, component)| shading.part(part)[component]).collect();
        let fields = self.light.fields();
        self.light.run(&at.0[1], R::ZERO, &mut registers, |place| match &fields[place] {
            Input { name, component } if name == CUT => cut[*component],
            input => field(f, input),
        });
        let mut numbers = self.light.outputs(&at.0[1], &registers).map(R::wide);
        let mut take = |count: usize| -> Vec<f64> { numbers.by_ref().take(count).collect() };
        let mut four = || {
            let four = take(4);
            std::array::from_fn(|c| four.get(c).copied().unwrap_or(f64::NAN))
        };
        let rgba = four();
        let mut slopes = [[0.0; 4]; Param::COUNT];
        for param in &self.free {
            slopes[param.index()] = four();
        }
        let mut summands = [0.0; 4];
        for (at, part) in numbers.enumerate() {
            summands[at % 3] += part.abs();
        }
        Shaded { rgba, slopes, summands }
    }
}

/// A number of a fragment by the rules' name; 0 of what it does not hold.
fn field<R: Scalar>(f: &Fragment<R>, Input { name, component }: &Input) -> R {
    f.number(name, *component).unwrap_or(R::ZERO)
}
