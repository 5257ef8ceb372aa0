//! The cheapest set of rules that yields what is wanted, within the accuracy budget: A*, backwards from
//! the goal.
//!
//! A state is what is still wanted, and in which domain. Of that, the quantity that lies furthest from the inputs is
//! taken. Each rule that gives it there leads to a state where its own needs are wanted instead; each edge
//! ([`domain`](super::domain)) to one where the quantity is wanted in the domain that the edge comes from. So the search
//! decides where a quantity is computed as it decides how: a rule costs its operations times how often its domain is
//! evaluated ([`Work`](super::domain::Work)), an edge what it takes to bring the quantity over. As needs always lie
//! nearer to the inputs, no quantity is decided upon twice. A rule that gives several quantities pays once.
//! A state's least cost is the sum, over what it still wants and what every derivation of that wants in turn, of the cheapest
//! rule's share: never more than the true cost, so the first solution found is the best. Where there is one derivation of most
//! quantities, as for the many alike of a scene's lights, it is nearly the true cost, and the search goes straight.

use pathfinding::directed::astar::astar;

use super::bits::Bits;
use super::domain::Domain;
use super::facts::{Budget, Facts};
pub use super::graph::Carried;
use super::graph::{Derivation, Graph, Producer};
use super::rule::Rule;
use super::term;
use crate::model::effects::{Effect, Effects};
use crate::model::fields::Field;

/// Costs and errors in the search are whole numbers of steps: how many make one.
const COST_STEPS: f64 = 16.0;
const ERROR_STEPS: f64 = 1e9;

/// A quantity that nothing gives.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
pub enum PlanError {
    /// No set of rules yields it within the budget.
    #[error(
        "no set of shader rules yields {goals} for this scene within the accuracy asked for. Allow a larger error, or report the scene."
    )]
    NoPlan {
        /// What was wanted.
        goals: String,
    },
    /// Quantities of an atlas where there is none.
    #[error(
        "the effect {effect} is computed in texels of the UV atlas, which samples made on an adapter and meshes without texture coordinates do not have. Leave the effect out there, or have the CPU make the samples."
    )]
    NoAtlas {
        /// The effect.
        effect: &'static str,
    },
    /// Levels that the processor alone makes.
    #[error(
        "{level} is made by distance over the surface, which graphics adapters do not do. Say method = \"separable\" in [diffusion], or have the CPU draw."
    )]
    OverSurface {
        /// The level.
        level: &'static str,
    },
    /// Blurs across the seams of an atlas.
    #[error(
        "{level} is blurred across the seams of the UV atlas, which graphics adapters do not do. Say seams = \"cut\" in [diffusion], or have the CPU draw."
    )]
    Joined {
        /// The level.
        level: &'static str,
    },
    /// Steps between texels that no triangle tells.
    #[error(
        "{level} is made of steps from texel to texel (dpdx, dpdy) of what no vertex holds, which graphics adapters do not know. Have rules take steps of what vertices hold, as `vertex_position`."
    )]
    BetweenTexels {
        /// The level.
        level: String,
    },
    /// Maps that samples made on an adapter do not read.
    #[error(
        "{field} is looked up in a map of its own, which samples made on an adapter do not read. Have the CPU make the samples."
    )]
    OfMap {
        /// The field.
        field: String,
    },
    /// Quantities that the processor alone finds.
    #[error(
        "{field} is found at each sample by rays, which samples made on an adapter have none of. Have the CPU make the samples."
    )]
    OfRays {
        /// The field.
        field: String,
    },
    /// Quantities that need one another.
    #[error(
        "shader rules need one another in a circle, among {goals}. This is a fault of skinfit: please report it."
    )]
    Circle {
        /// Among which.
        goals: String,
    },
}

impl PlanError {
    /// That samples made on an adapter lack a field.
    #[must_use]
    pub fn not_found_on_adapters(field: &str) -> Self {
        let mapped = Field::from_name(field).is_some_and(|field| field.map().is_some());
        let field = field.to_owned();
        if mapped { Self::OfMap { field } } else { Self::OfRays { field } }
    }

    /// That there are no texels for the one of `effects` that is computed there.
    #[must_use]
    pub fn no_atlas(effects: Effects) -> Self {
        Self::NoAtlas { effect: term::of_texels(effects).map_or("added", Effect::name) }
    }
}

#[derive(Clone, PartialEq, Eq, Hash)]
struct State {
    /// Wants that are open, a bit each.
    open: Bits,
    /// Wants that a rule with several quantities has given already.
    have: Bits,
    /// Error so far.
    error: u64,
}

/// What a search has found.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// The rules, in an order in which they can be evaluated, by domain.
    pub rules: Vec<&'static Rule>,
    /// The edges that quantities take from one domain to another.
    pub carried: Vec<Carried>,
}

/// The rules and edges that yield `goals` for fragments (and `vertex_goals` for vertices) at the least cost.
///
/// `given` quantities of fragments are there already. A vertex rule that both the image and the atlas need is counted
/// once.
///
/// # Errors
/// When there are none.
pub fn search(
    facts: &Facts,
    vertex_goals: &[&'static str],
    goals: &[&'static str],
    given: &[&'static str],
) -> Result<Found, PlanError> {
    let graph = Graph::new(facts, given)?;
    let no_plan = || PlanError::NoPlan { goals: [vertex_goals, goals].concat().join(", ") };
    let search = Search::new(&graph);
    let mut start = State { open: Bits::default(), have: Bits::default(), error: 0 };
    let wanted = vertex_goals.iter().map(|q| (Domain::Vertex, *q));
    for want in wanted.chain(goals.iter().map(|q| (Domain::Fragment, *q))) {
        let number = graph.number(want).ok_or_else(|| match term::of_texels(facts.setup.effects) {
            Some(_) if facts.holds("atlas") != Some(true) => PlanError::no_atlas(facts.setup.effects),
            _ => no_plan(),
        })?;
        start.open = start.open.or(&Bits::one(number));
    }
    let (path, _) =
        astar(&start, |state| search.successors(state), |state| search.least(state), |s| s.open.is_empty())
            .ok_or_else(no_plan)?;
    let mut found = Found::default();
    for derivation in path.windows(2).filter_map(|pair| search.between(pair)) {
        match derivation.producer {
            Producer::Rule(rule) => found.rules.push(rule),
            Producer::Edge(carried) => found.carried.push(carried),
        }
    }
    found.carried.reverse();
    found.rules.reverse();
    found.rules.sort_by_key(|rule| rule.domain);
    Ok(found)
}

/// How many numbers a WGSL type holds.
pub fn components(wgsl: &str) -> usize {
    match wgsl {
        "vec2f" => 2,
        "vec3f" => 3,
        "vec4f" | "vec4u" => 4,
        _ => 1,
    }
}

/// A graph, and what bounds the cost of a state from below.
struct Search<'a> {
    graph: &'a Graph<'a>,
    /// Of each want the cheapest derivation's share, in whole steps.
    cheapest: Vec<u64>,
    /// Of each want itself, and what every derivation of it wants in turn.
    surely: Vec<Bits>,
}

impl<'a> Search<'a> {
    fn new(graph: &'a Graph<'a>) -> Self {
        let share = |one: &Derivation| steps(one) / u64::from(one.gives.count());
        let cheapest =
            graph.derivations().iter().map(|of_want| of_want.iter().map(share).min().unwrap_or(0)).collect();
        // Needs lie nearer to the inputs: theirs are there already.
        let mut surely: Vec<Bits> = Vec::new();
        for (at, of_want) in graph.derivations().iter().enumerate() {
            let beyond =
                |one: &Derivation| one.needs.iter().fold(Bits::default(), |all, need| all.or(&surely[need]));
            let of_all = of_want.iter().map(beyond).reduce(|all, one| all.and(&one)).unwrap_or_default();
            surely.push(of_all.or(&Bits::one(at)));
        }
        Self { graph, cheapest, surely }
    }

    fn successors(&self, state: &State) -> Vec<(State, u64)> {
        // The open want that lies furthest from the inputs.
        let Some(at) = state.open.greatest() else { return Vec::new() };
        self.graph.derivations()[at]
            .iter()
            .filter_map(|derivation| self.step(state, at, derivation))
            .collect()
    }

    fn step(&self, state: &State, at: usize, derivation: &Derivation) -> Option<(State, u64)> {
        let have = state.have.clone().or(&derivation.gives);
        let open = state.open.clone().or(&derivation.needs).without(&have);
        // What lies beyond is never wanted again: forgetting it makes more states alike.
        let have = have.below(at);
        let error = (derivation.error * ERROR_STEPS).ceil() as u64;
        let error = match self.graph.facts.budget {
            Budget::Within(most) => {
                let sum = state.error + error;
                (sum as f64 <= most * ERROR_STEPS + 0.5).then_some(sum)?
            }
            // Told by each rule's `refusal`; states that differ by it alone are the same.
            Budget::Exact | Budget::Paper => 0,
        };
        Some((State { open, have, error }, steps(derivation)))
    }

    /// A bound on what is still to be paid at the least.
    fn least(&self, state: &State) -> u64 {
        let wanted = state.open.iter().fold(Bits::default(), |all, at| all.or(&self.surely[at]));
        wanted.without(&state.have).iter().map(|at| self.cheapest[at]).sum()
    }

    /// The derivation that leads from one state of a path to the next.
    fn between(&self, pair: &[State]) -> Option<&Derivation> {
        let at = pair[0].open.greatest()?;
        let taken =
            self.graph.derivations()[at].iter().filter_map(|one| Some((one, self.step(&pair[0], at, one)?)));
        // Of derivations that lead to the same state the path's cost chose the cheapest.
        let (derivation, _) =
            taken.filter(|(_, (state, _))| *state == pair[1]).min_by_key(|(_, (_, cost))| *cost)?;
        Some(derivation)
    }
}

/// A derivation's cost in whole steps.
fn steps(derivation: &Derivation) -> u64 {
    (derivation.cost * COST_STEPS).round() as u64
}
