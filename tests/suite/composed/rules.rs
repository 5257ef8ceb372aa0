//! The planned rules of the file's fragments, in any kind of number, and what they look up of its atlas.

use skinfit::engine::cubes_at::CubesAt;
use skinfit::engine::levels::{LevelMaker, Number as LevelNumber};
use skinfit::model::evaluate::Setup;
use skinfit::model::params::{Param, Params};
use skinfit::samples::ViewSamples;
use skinfit::shader::tangent::chain::Seed;
use skinfit_core::program::graph::Input;
use skinfit_core::program::levels::LevelProgram;
use skinfit_core::program::lower::Natives;
use skinfit_core::program::shading::{Shading, constant};
use skinfit_core::program::steps::{Rounding, Steps};

use super::file::Composed;
use super::stored::facts;
use crate::by_rules::{Function, Number};

/// The planned rules of a setup, the sum's derivatives by some parameters, and quantities on the way.
pub(super) struct Rules {
    pub(super) setup: Setup,
    steps: Steps,
    slopes: usize,
    levels: LevelProgram,
    samples: ViewSamples,
    /// How many numbers each quantity has.
    pub(super) widths: Vec<(&'static str, usize)>,
}

/// What the rules make of a fragment.
pub(super) struct Shaded {
    /// Radiance and haze, and then how they move.
    pub(super) rgba: Vec<[f64; 4]>,
    quantities: Vec<(&'static str, Vec<f64>)>,
}

impl Shaded {
    pub(super) fn of(&self, name: &str) -> &[f64] {
        &self.quantities.iter().find(|(known, _)| *known == name).unwrap_or_else(|| panic!("no {name}")).1
    }

    pub(super) fn three(&self, name: &str) -> [f64; 3] {
        self.of(name).try_into().unwrap()
    }

    /// The sum of some terms.
    pub(super) fn sum(&self, names: &[&str]) -> [f64; 3] {
        [0, 1, 2].map(|c| names.iter().map(|name| self.of(name)[c]).sum())
    }
}

/// What all fragments look up of the atlas: by the row of each number.
pub(super) struct LookedUp {
    rows: Vec<Vec<f64>>,
    maker: LevelMaker<f64>,
}

impl LookedUp {
    /// A number of a fragment's, where it is one of these.
    fn get(&self, i: usize, input: &Input) -> Option<f64> {
        self.maker.row(input).map(|row| self.rows[row][i])
    }

    pub(super) fn three(&self, i: usize, name: &str) -> [f64; 3] {
        [0, 1, 2].map(|component| self.get(i, &Input { name: name.to_owned(), component }).unwrap())
    }
}

impl Rules {
    pub(super) fn new(own: &Composed<'_>, setup: Setup, free: &[Param]) -> Self {
        let seeds: Vec<Seed> = free.iter().map(|&param| Seed::of_param(param)).collect();
        let shading = Shading::new(&facts(setup), &seeds, |_| None, Natives::Written).unwrap();
        let mut outputs = [&[shading.value], &shading.tangents[..]].concat().concat();
        outputs.extend(shading.quantities.values().flatten());
        let widths = shading.quantities.iter().map(|(&name, ids)| (name, ids.len())).collect();
        let steps = Steps::new(&shading.graph, &outputs, |_| Rounding::Plain);
        let samples = own.samples(setup);
        Self { setup, steps, slopes: free.len(), levels: shading.levels, samples, widths }
    }

    /// What fragments look up at `params`: levels of `R`'s width.
    pub(super) fn look_up<R: Number>(&self, own: &Composed<'_>, params: &Params) -> LookedUp {
        let rows = if size_of::<R>() == size_of::<f64>() {
            self.rows::<f64>(own, params)
        } else {
            self.rows::<f32>(own, params)
        };
        LookedUp { rows, maker: LevelMaker::new(self.levels.clone()) }
    }

    fn rows<L: LevelNumber>(&self, own: &Composed<'_>, params: &Params) -> Vec<Vec<f64>> {
        let cubes = || CubesAt::new(&own.illumination(), params, |x| L::from(x));
        LevelMaker::<L>::new(self.levels.clone())
            .look_up(&self.samples, params, cubes, |row| row.map(Into::into).to_vec())
    }

    /// A fragment in numbers of `like`'s kind; every lane has the same. `light` is E_r.
    pub(super) fn shade<R: Number>(
        &self,
        own: &Composed<'_>,
        params: &Params,
        light: [f64; 3],
        (i, found): (usize, &LookedUp),
        like: R,
    ) -> Shaded {
        let cubes = own.cubes.each_ref().map(|cube| cube.map(|texel| texel.map(R::texel)));
        let even = own.cubes[0].map(|_| [light[0], light[1], light[2], 0.0].map(R::texel));
        let cube = |name: &str| match name {
            "irradiance_faces" => &cubes[0],
            "specular_faces" => &cubes[1],
            "hilite_faces" => &cubes[2],
            "reflected_faces" | "glossy_faces" => &even,
            other => panic!("there is no cube {other}"),
        };
        let setting = self.steps.setting(like, |input| constant(input, params).unwrap(), cube);
        let mut registers = Vec::new();
        self.steps.run(&setting, like, &mut registers, |place| {
            let input = &self.steps.fields()[place];
            like.lit(found.get(i, input).unwrap_or_else(|| own.field(i, input)))
        });
        let numbers: Vec<f64> =
            self.steps.outputs(&setting, &registers).map(|number| number.unpack()[0]).collect();
        let (light, mut rest) = numbers.split_at(4 * (1 + self.slopes));
        let mut quantities = Vec::new();
        for &(name, width) in &self.widths {
            quantities.push((name, rest[..width].to_vec()));
            rest = &rest[width..];
        }
        let rgba = light.chunks(4).map(|four| [four[0], four[1], four[2], four[3]]).collect();
        Shaded { rgba, quantities }
    }

    /// One of the rules alone, a vector of what its arguments make.
    pub(super) fn rule(&self, name: &str, arguments: &[&[f64]]) -> [f64; 3] {
        let widths: Vec<usize> = arguments.iter().map(|argument| argument.len()).collect();
        Function::of_rule(self.setup.effects, name, &widths).of(0.0, arguments).try_into().unwrap()
    }
}
