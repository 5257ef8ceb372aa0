//! The planned rules over single fragments, and functions of theirs alone, in any kind of number: f64, f32, and sixteen
//! SIMD lanes of each instruction set.

use std::sync::{Arc, Mutex, PoisonError};

use fearless_simd::Level;
use skinfit::engine::lanes::Lanes;
use skinfit::model::cube::{Channel, Cube};
use skinfit::model::effects::Effects;
use skinfit::model::evaluate::Setup;
use skinfit::model::params::{Param, Params};
use skinfit::model::real::Real;
use skinfit::samples::LANES;
use skinfit::shader::facts::{FaceSizes, MapFacts};
use skinfit::shader::rule::{LIBRARY, rules};
use skinfit::shader::tangent::Tangents;
use skinfit::shader::tangent::chain::Seed;
use skinfit::shader::{Facts, Source};
use skinfit::simd::levels;
use skinfit_core::program::graph::{Graph, Input};
use skinfit_core::program::lower::{self, Natives, Value};
use skinfit_core::program::shading::{Shading, constant};
use skinfit_core::program::steps::{self, Rounding, Steps};

use crate::vectors::reader::{Tolerance, Tolerances};

/// A number that holds one or more of f64's.
pub(crate) trait Number: Real<Texel: Channel> {
    /// How many.
    const COUNT: usize;
    fn texel(x: f64) -> Self::Texel;
    /// Of [`Self::COUNT`] numbers.
    fn pack(self, numbers: &[f64]) -> Self;
    fn unpack(self) -> Vec<f64>;
}

impl Number for f64 {
    const COUNT: usize = 1;
    fn texel(x: f64) -> f64 {
        x
    }
    fn pack(self, numbers: &[f64]) -> Self {
        numbers[0]
    }
    fn unpack(self) -> Vec<f64> {
        vec![self]
    }
}

impl Number for f32 {
    const COUNT: usize = 1;
    fn texel(x: f64) -> f32 {
        x as f32
    }
    fn pack(self, numbers: &[f64]) -> Self {
        numbers[0] as f32
    }
    fn unpack(self) -> Vec<f64> {
        vec![self.into()]
    }
}

impl<S: fearless_simd::Simd> Number for Lanes<S> {
    const COUNT: usize = LANES;
    fn texel(x: f64) -> f32 {
        x as f32
    }
    fn pack(self, numbers: &[f64]) -> Self {
        Self::of_row(self.0.simd, &std::array::from_fn(|lane| numbers[lane] as f32))
    }
    fn unpack(self) -> Vec<f64> {
        self.to_array().map(f64::from).to_vec()
    }
}

/// A kind of number.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    Double,
    Single,
    /// SIMD lanes of an instruction set.
    InLanes(Level),
}

/// What generic code makes in numbers of a [`Kind`], of one of them, `like`.
macro_rules! in_kind {
    ($kind:expr, $like:ident => $made:expr) => {
        match $kind {
            $crate::by_rules::Kind::Double => {
                let $like = 0.0_f64;
                $made
            }
            $crate::by_rules::Kind::Single => {
                let $like = 0.0_f32;
                $made
            }
            $crate::by_rules::Kind::InLanes(level) => skinfit_core::with_simd!(level, simd => {
                let $like = ::skinfit::engine::lanes::Lanes::splat(simd, 0.0);
                $made
            }),
        }
    };
}
pub(crate) use in_kind;

impl Kind {
    /// All that this machine runs.
    pub(crate) fn all() -> Vec<Self> {
        std::iter::once(Self::Double).chain(Self::narrow()).collect()
    }

    /// Those of 32 bits.
    pub(crate) fn narrow() -> Vec<Self> {
        std::iter::once(Self::Single).chain(levels().into_iter().map(Self::InLanes)).collect()
    }

    /// What is near in them: lanes have exp2 and log2 by polynomials of some units in the last place, and fuse products
    /// with sums, where f32 rounds each correctly.
    pub(crate) fn near(self, near: Tolerances) -> Tolerance {
        match self {
            Self::Double => near.double,
            Self::Single => near.single,
            Self::InLanes(_) => near.single.times(4.0),
        }
    }
}

/// The cubes that rules look up.
#[derive(Clone, Debug)]
pub(crate) struct Cubes<T> {
    pub(crate) irradiance: Cube<T>,
    pub(crate) specular: Cube<T>,
    pub(crate) specular_slope: Cube<T>,
    pub(crate) hilite: Cube<T>,
}

impl<T: Copy> Cubes<T> {
    fn faces(&self) -> FaceSizes {
        FaceSizes {
            irradiance: Some(self.irradiance.size()),
            specular: Some(self.specular.size()),
            hilite: Some(self.hilite.size()),
            reflected: None,
        }
    }

    fn named(&self, name: &str) -> &Cube<T> {
        match name {
            "irradiance_faces" => &self.irradiance,
            "specular_faces" => &self.specular,
            "specular_slope_faces" => &self.specular_slope,
            "hilite_faces" => &self.hilite,
            other => panic!("there is no cube {other}"),
        }
    }
}

/// Outputs wanted of rules beside radiance and haze: how these move with parameters, and quantities on the way.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Wanted {
    pub(crate) free: Vec<Param>,
    pub(crate) quantities: Vec<&'static str>,
}

/// The rules of a setup for stored samples, with all that fragments share.
pub(crate) struct Fragments<'a, R: Number> {
    steps: Arc<Steps>,
    setting: steps::Setting<'a, R>,
    like: R,
    slopes: usize,
}

/// A shaded fragment.
#[derive(Clone, Debug)]
pub(crate) struct Shaded<R> {
    /// Radiance and haze.
    pub(crate) rgba: [R; 4],
    /// How they move with each of [`Wanted::free`].
    pub(crate) slopes: Vec<[R; 4]>,
    /// The numbers of [`Wanted::quantities`], one after another.
    pub(crate) quantities: Vec<R>,
}

/// Plans, and what they were made for: they are the same in every kind of number.
type Known = Vec<((Setup, FaceSizes, Wanted), Arc<Steps>)>;

fn steps_of(setup: Setup, faces: FaceSizes, wanted: &Wanted) -> Arc<Steps> {
    static KNOWN: Mutex<Known> = Mutex::new(Vec::new());
    let key = (setup, faces, wanted.clone());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, steps)) = known.iter().find(|(other, _)| *other == key) {
        return Arc::clone(steps);
    }
    let maps = MapFacts::default();
    let facts = Facts { setup, source: Source::Samples, maps, faces, turned: true, ..Facts::default() };
    let seeds: Vec<Seed> = wanted.free.iter().map(|&param| Seed::of_param(param)).collect();
    let shading = Shading::new(&facts, &seeds, |_| None, Natives::Written).unwrap();
    let mut outputs = [&[shading.value], &shading.tangents[..]].concat().concat();
    outputs.extend(wanted.quantities.iter().flat_map(|name| &shading.quantities[name]));
    let steps = Arc::new(Steps::new(&shading.graph, &outputs, |_| Rounding::Plain));
    known.push((key, Arc::clone(&steps)));
    steps
}

impl<'a, R: Number> Fragments<'a, R> {
    /// Of a setup at `params`, in numbers of `like`'s kind.
    pub(crate) fn new(
        setup: Setup,
        cubes: &'a Cubes<R::Texel>,
        params: &Params,
        wanted: &Wanted,
        like: R,
    ) -> Self {
        let steps = steps_of(setup, cubes.faces(), wanted);
        let setting = steps.setting(like, |input| constant(input, params).unwrap(), |name| cubes.named(name));
        Self { steps, setting, like, slopes: wanted.free.len() }
    }

    /// A fragment, whose numbers `field` gives by the rules' names.
    pub(crate) fn shade(&self, field: impl Fn(&Input) -> R) -> Shaded<R> {
        let mut registers = Vec::new();
        self.steps.run(&self.setting, self.like, &mut registers, |place| field(&self.steps.fields()[place]));
        let numbers: Vec<R> = self.steps.outputs(&self.setting, &registers).collect();
        let (light, quantities) = numbers.split_at(4 * (1 + self.slopes));
        let mut fours = light.chunks(4).map(|four| [four[0], four[1], four[2], four[3]]);
        let rgba = fours.next().unwrap();
        Shaded { rgba, slopes: fours.collect(), quantities: quantities.to_vec() }
    }
}

/// The function of a rule that those effects bring, and what it uses.
fn texts_of_rule(effects: Effects, name: &str) -> Vec<&'static str> {
    let rule = rules(effects).find(|rule| rule.function == name);
    let rule = rule.unwrap_or_else(|| panic!("there is no rule {name}"));
    let used = LIBRARY.iter().filter(|(library, _)| rule.uses.contains(library)).map(|(_, text)| *text);
    used.chain([rule.body]).collect()
}

/// A function of the rules, alone.
pub(crate) struct Function(Steps);

impl Function {
    /// The function `name` of some texts, with the number of components of each of its arguments.
    pub(crate) fn new(texts: &[&str], name: &str, arguments: &[usize]) -> Self {
        let source = lower::Source::new(&texts.concat(), Natives::Written).unwrap();
        let mut graph = Graph::default();
        let mut argument = |(at, &width): (usize, &usize)| {
            Value::Numbers((0..width).map(|component| graph.field(&at.to_string(), component)).collect())
        };
        let arguments = arguments.iter().enumerate().map(&mut argument).collect();
        let outputs = source.call(&mut graph, name, arguments).unwrap();
        Self(Steps::new(&graph, &outputs, |_| Rounding::Plain))
    }

    /// The function of a rule that those effects bring, with what it uses.
    pub(crate) fn of_rule(effects: Effects, name: &str, arguments: &[usize]) -> Self {
        Self::new(&texts_of_rule(effects, name), name, arguments)
    }

    /// How it moves along one of its arguments: of its arguments, then of that one's tangent.
    pub(crate) fn tangent_of_rule(effects: Effects, name: &str, arguments: &[usize], moved: usize) -> Self {
        Self::tangent(&texts_of_rule(effects, name), name, arguments, moved)
    }

    /// How the function moves along one of its arguments: of its arguments, then of that one's tangent.
    pub(crate) fn tangent(texts: &[&str], name: &str, arguments: &[usize], moved: usize) -> Self {
        let text = texts.concat();
        let mut tangents = Tangents::new(&text).unwrap();
        let moving: Vec<bool> = (0..arguments.len()).map(|i| i == moved).collect();
        let tangent = tangents.of(name, &moving).unwrap().unwrap();
        assert!(!tangent.of_all, "{name} has a tangent by hand");
        Self::new(&[&text, tangents.text()], &tangent.name, &[arguments, &arguments[moved..=moved]].concat())
    }

    /// Its value.
    pub(crate) fn of<R: Real>(&self, like: R, arguments: &[&[R]]) -> Vec<R> {
        let setting = self.0.setting(like, |_| 0.0, |name| panic!("it looks {name} up"));
        let mut registers = Vec::new();
        self.0.run(&setting, like, &mut registers, |place| {
            let Input { name, component } = &self.0.fields()[place];
            arguments[name.parse::<usize>().unwrap()][*component]
        });
        self.0.outputs(&setting, &registers).collect()
    }
    /// Its value in a kind of number.
    pub(crate) fn of_kind(&self, kind: Kind, arguments: &[&[f64]]) -> Vec<f64> {
        in_kind!(kind, like => self.of_numbers(like, arguments))
    }

    fn of_numbers<R: Number>(&self, like: R, arguments: &[&[f64]]) -> Vec<f64> {
        let given = |list: &&[f64]| list.iter().map(|&x| like.lit(x)).collect();
        let given: Vec<Vec<R>> = arguments.iter().map(given).collect();
        let given: Vec<&[R]> = given.iter().map(|list| &list[..]).collect();
        self.of(like, &given).into_iter().map(|x| x.unpack()[0]).collect()
    }
}
