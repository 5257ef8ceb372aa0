//! The chain rule over a plan's steps: how its output moves with a constant, a quantity or a resource.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::{TangentError, Tangents};
use crate::model::params::Param;
use crate::shader::atlas::Level;
use crate::shader::atlas::tangent::Along;
use crate::shader::domain::Domain;
use crate::shader::emit::{Plan, hazy, parts};
use crate::shader::module::uniform;
use crate::shader::quantity::{Constant, Resource};
use crate::shader::rule::Rule;

/// What moves: a constant or a quantity, the content of resources, or all of these at once.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Seed {
    /// A constant or a quantity.
    pub named: Option<Named>,
    /// Resources that every lookup is linear in.
    pub resources: Vec<Looked>,
}

/// A constant or a quantity that moves.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Named {
    /// Its name in rules.
    pub name: &'static str,
    /// How it moves: WGSL of its type.
    pub tangent: String,
}

/// A resource whose content moves.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Looked {
    /// What rules read.
    pub resource: Resource,
    /// What holds how its texels move.
    pub slope: Resource,
    /// How fast, in WGSL of an `f32`; empty for 1.
    pub pace: String,
}

/// Quantities that move, and how (WGSL of their types).
pub type Moved = BTreeMap<&'static str, String>;

/// How a plan's output moves along seeds.
#[derive(Clone, Debug, Default)]
pub struct Chain {
    /// Functions that the lines call, to stand after the plan's own.
    pub functions: String,
    /// Resources that they read beside the plan's.
    pub resources: Vec<Resource>,
    /// Constants that they read beside the plan's.
    pub constants: Vec<Constant>,
    /// Lines to stand after the plan's calls, before those of any seed: slopes that several of them share.
    pub shared: String,
    /// For each seed its lines, to stand after those; they name what the calls do.
    pub lines: Vec<String>,
    /// For each seed, how the radiance moves (WGSL of a `vec3f`); `None` where it stays.
    pub radiance: Vec<Option<String>>,
    /// For each seed, how the haze moves (an `f32`).
    pub haze: Vec<Option<String>>,
    /// For each seed, the quantities that move with it, and how (WGSL of their types).
    pub moved: Vec<Moved>,
    /// For each seed, how levels of the atlas move; empty where the plan looks none up.
    pub along: Vec<Along>,
}

impl Chain {
    /// Of the fragment stage of a plan over stored samples, whose fields stand in `at`.
    ///
    /// # Errors
    /// When a rule does what the chain rule is not written for.
    pub fn new(plan: &Plan, seeds: &[Seed]) -> Result<Self, TangentError> {
        let mut tangents = Tangents::new(&plan.declarations(true))?;
        let mut chain = Self::default();
        let mut read = Vec::new();
        for (k, seed) in seeds.iter().enumerate() {
            if !plan.passes.is_empty() {
                chain.along.push(Along::new(plan, seed)?);
            }
            read.push(chain.read(plan, k));
        }
        for moved in chain.follow(plan, Domain::Fragment, seeds, read, &mut tangents)? {
            let along: Vec<&str> = parts(&plan.facts)
                .into_iter()
                .filter_map(|part| moved.get(part).map(String::as_str))
                .collect();
            chain.radiance.push((!along.is_empty()).then(|| along.join(" + ")));
            chain.haze.push(if hazy(&plan.facts) { moved.get("haze").cloned() } else { None });
            chain.moved.push(moved);
        }
        chain.functions.push_str(tangents.text());
        Ok(chain)
    }

    /// What was looked up of levels that move with the `k`-th seed, and the field of a sample that holds how.
    fn read(&self, plan: &Plan, k: usize) -> Moved {
        let Some(along) = self.along.get(k) else { return BTreeMap::new() };
        let moves =
            |name: &str| along.moved.contains_key(name) && plan.levels.iter().any(|level| level.name == name);
        let needs = plan.rules(Domain::Fragment).flat_map(|rule| &rule.needs);
        needs.filter(|(name, _)| moves(name)).map(|(name, _)| (*name, format!("at.d{k}_{name}"))).collect()
    }

    /// The fields of a sample that hold how what was looked up moves, seed by seed, each with the level that holds it.
    pub(in crate::shader) fn looked_up(&self, plan: &Plan) -> Vec<(String, Level)> {
        let of_seed = |(k, along): (usize, &Along)| -> Vec<(String, Level)> {
            let field =
                |level: &Level| Some((format!("d{k}_{}", level.name), along.moved.get(&level.name)?.clone()));
            plan.levels.iter().filter_map(field).collect()
        };
        self.along.iter().enumerate().flat_map(of_seed).collect()
    }

    /// Of the texels of a draw into the atlas; `read` are for each seed quantities whose tangents stand there. The quantities
    /// that move along the `k`-th seed are `moved[k]`.
    pub(in crate::shader) fn of_texels(
        plan: &Plan,
        seeds: &[Seed],
        read: Vec<Moved>,
    ) -> Result<Self, TangentError> {
        let mut tangents = Tangents::new(&plan.declarations(true))?;
        let mut chain = Self::default();
        chain.moved = chain.follow(plan, Domain::Texel, seeds, read, &mut tangents)?;
        chain.functions.push_str(tangents.text());
        Ok(chain)
    }

    /// The lines of all seeds, `moved` being what moves with each before any rule; returns the quantities that move with
    /// each, and how.
    fn follow(
        &mut self,
        plan: &Plan,
        domain: Domain,
        seeds: &[Seed],
        mut moved: Vec<Moved>,
        tangents: &mut Tangents,
    ) -> Result<Vec<Moved>, TangentError> {
        self.lines = vec![String::new(); seeds.len()];
        for (k, seed) in seeds.iter().enumerate() {
            self.begin(plan, domain, k, seed, &mut moved[k]);
        }
        for rule in plan.rules(domain) {
            let slopes = self.slopes(plan, rule, &moved, tangents)?;
            for (k, seed) in seeds.iter().enumerate() {
                let content =
                    seed.resources.iter().filter(|looked| rule.reads.contains(&looked.resource.name()));
                let content: Vec<String> =
                    content.map(|looked| self.slope_call(plan, rule, looked)).collect();
                let along =
                    match lone(rule, &moved[k]).and_then(|need| slopes.get(need).zip(moved[k].get(need))) {
                        Some((slope, moved)) => Some(format!("{moved} * {slope}")),
                        None => tangent_call(plan, rule, &moved[k], tangents)?,
                    };
                let call = content.into_iter().chain(along).reduce(|all, call| format!("{all} + {call}"));
                // A seed's own quantity moves as it was told to.
                let held = |quantity: &str| seed.named.as_ref().is_some_and(|named| named.name == quantity);
                if let Some(call) = call {
                    self.lines_of(k, rule, &call, &mut moved[k], held);
                }
            }
        }
        Ok(moved)
    }

    /// A seed's own tangent.
    fn begin(&mut self, plan: &Plan, domain: Domain, k: usize, seed: &Seed, moved: &mut Moved) {
        let Some(Named { name, tangent }) = &seed.named else { return };
        let typed = plan.rules(domain).flat_map(|rule| &rule.needs).find(|need| need.0 == *name);
        if let Some((_, kind)) = typed {
            let _ = writeln!(self.lines[k], "    let d{k}_{name}: {kind} = {tangent};");
            moved.insert(name, format!("d{k}_{name}"));
            self.reads(plan, tangent);
        }
    }

    /// A rule's slopes along numbers that more than one seed moves, and nothing else of what it needs: what all of these
    /// move through (roughness and gloss a lobe's width) is then followed once, and each costs a product a rule.
    fn slopes(
        &mut self,
        plan: &Plan,
        rule: &Rule,
        moved: &[Moved],
        tangents: &mut Tangents,
    ) -> Result<BTreeMap<&'static str, String>, TangentError> {
        let mut slopes = BTreeMap::new();
        if rule.plain_value().is_some() {
            return Ok(slopes);
        }
        let lone: Vec<&'static str> = moved.iter().filter_map(|moved| lone(rule, moved)).collect();
        for &need in &lone {
            let several = lone.iter().filter(|other| **other == need).count() > 1;
            if !several || slopes.contains_key(need) {
                continue;
            }
            let along = BTreeMap::from([(need, "1.0".to_owned())]);
            if let Some(call) = tangent_call(plan, rule, &along, tangents)? {
                let name = format!("{}_by_{need}", rule.function);
                let _ = writeln!(self.shared, "    let {name}: {} = {call};", rule.returns);
                slopes.insert(need, name);
            }
        }
        Ok(slopes)
    }

    fn lines_of(
        &mut self,
        k: usize,
        rule: &Rule,
        call: &str,
        moved: &mut Moved,
        held: impl Fn(&str) -> bool,
    ) {
        if let [(quantity, "")] = rule.gives.as_slice() {
            if !held(quantity) {
                let _ = writeln!(self.lines[k], "    let d{k}_{quantity}: {} = {call};", rule.returns);
                moved.insert(quantity, format!("d{k}_{quantity}"));
            }
            return;
        }
        let both = format!("d{k}_{}_and_more", rule.gives[0].0);
        let _ = writeln!(self.lines[k], "    let {both}: {} = {call};", rule.returns);
        for (quantity, swizzle) in rule.gives.iter().filter(|(quantity, _)| !held(quantity)) {
            moved.insert(quantity, format!("{both}.{swizzle}"));
        }
    }

    /// Constants that a tangent is made of are read.
    fn reads(&mut self, plan: &Plan, tangent: &str) {
        for constant in constants(tangent) {
            if !plan.constants.contains(&constant) && !self.constants.contains(&constant) {
                self.constants.push(constant);
            }
        }
    }

    /// A rule's function with another resource in the place of the one that it reads.
    fn slope_call(&mut self, plan: &Plan, rule: &Rule, looked: &Looked) -> String {
        let Looked { resource, slope, pace } = looked;
        let name = format!("{}_slope", rule.function);
        let definition = format!("fn {name}(");
        if !self.functions.contains(&definition) {
            let body = rule.body.replacen(&format!("fn {}(", rule.function), &definition, 1);
            let _ = write!(self.functions, "\n{}", body.replace(resource.name(), slope.name()));
        }
        if !self.resources.contains(slope) {
            self.resources.push(*slope);
        }
        self.reads(plan, pace);
        let paced = if pace.is_empty() { String::new() } else { format!("{pace} * ") };
        format!("{paced}{name}({})", arguments(plan, rule).join(", "))
    }
}

/// The one number that a rule needs and that moves; `None` where more moves than that, or nothing.
fn lone(rule: &Rule, moved: &Moved) -> Option<&'static str> {
    let mut moving = rule.needs.iter().filter(|(name, _)| moved.contains_key(name));
    let (name, kind) = moving.next()?;
    (*kind == "f32" && moving.next().is_none()).then_some(*name)
}

/// The call that yields how a rule's value moves; `None` where nothing that it needs does.
fn tangent_call(
    plan: &Plan,
    rule: &Rule,
    moved: &Moved,
    tangents: &mut Tangents,
) -> Result<Option<String>, TangentError> {
    let moving: Vec<bool> = rule.needs.iter().map(|(name, _)| moved.contains_key(name)).collect();
    if !moving.contains(&true) {
        return Ok(None);
    }
    match rule.plain_value() {
        Some("") => return Ok(moved.get(rule.needs[0].0).cloned()),
        Some(_) => return Ok(None),
        None => {}
    }
    let Some(tangent) = tangents.of(rule.function, &moving)? else { return Ok(None) };
    let mut given = arguments(plan, rule);
    for (name, kind) in &rule.needs {
        match moved.get(name) {
            Some(moved) => given.push(moved.clone()),
            None if tangent.of_all => given.push(format!("{kind}()")),
            None => {}
        }
    }
    Ok(Some(format!("{}({})", tangent.name, given.join(", "))))
}

fn arguments(plan: &Plan, rule: &Rule) -> Vec<String> {
    plan.arguments(rule, &|constant: Constant, kind: &str| uniform(constant, kind), &|name| {
        format!("at.{name}")
    })
}

/// The constants that WGSL names.
fn constants(wgsl: &str) -> impl Iterator<Item = Constant> {
    let names = wgsl.split("constants.").skip(1);
    names.filter_map(|rest| Constant::from_name(rest.split('.').next()?))
}

impl Seed {
    /// A constant or a quantity; `tangent` is WGSL of its type.
    #[must_use]
    pub fn named(name: &'static str, tangent: &str) -> Self {
        Self { named: Some(Named { name, tangent: tangent.to_owned() }), resources: Vec::new() }
    }

    /// The constants that tell how it moves.
    pub fn constants(&self) -> impl Iterator<Item = Constant> {
        let tangents = self.named.iter().map(|named| named.tangent.as_str());
        tangents.chain(self.resources.iter().map(|looked| looked.pace.as_str())).flat_map(constants)
    }

    /// A parameter of the model: each channel of a colour moves at once, as channels never mix.
    #[must_use]
    pub fn of_param(param: Param) -> Self {
        let looked = |resource, slope, pace: &str| Looked { resource, slope, pace: pace.to_owned() };
        let glossy = |pace| looked(Resource::GlossyFaces, Resource::GlossySlopeFaces, pace);
        let (named, resources) = match param {
            Param::SpecularLobe => {
                (None, vec![looked(Resource::SpecularFaces, Resource::SpecularSlopeFaces, "")])
            }
            // A degree.
            Param::EnvironmentRotation => {
                let tangent = "0.017453292 * vec2f(-constants.turn.y, constants.turn.x)";
                (Some((Constant::Turn.name(), tangent)), Vec::new())
            }
            Param::KeyAzimuth => {
                (Some((Constant::KeyDirection.name(), "constants.key_by_azimuth.xyz")), Vec::new())
            }
            Param::KeyElevation => {
                (Some((Constant::KeyDirection.name(), "constants.key_by_elevation.xyz")), Vec::new())
            }
            colour if colour.info().rgb => (Some((colour.identifier(), "vec3f(1.0)")), Vec::new()),
            scalar => {
                let resources = match scalar.identifier() {
                    "roughness" => vec![
                        looked(Resource::ReflectedFaces, Resource::ReflectedSlopeFaces, ""),
                        glossy("constants.glossy_paces.x"),
                    ],
                    "gloss" => vec![glossy("constants.glossy_paces.y")],
                    _ => Vec::new(),
                };
                (Some((scalar.identifier(), "1.0")), resources)
            }
        };
        let named = named.map(|(name, tangent)| Named { name, tangent: tangent.to_owned() });
        Self { named, resources }
    }
}
