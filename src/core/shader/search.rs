//! The cheapest set of rules that yields what is wanted, within the accuracy budget: A*, backwards from
//! the goal.
//!
//! A state is what is still wanted, and in which domain. Of that, the quantity that lies furthest from the inputs is
//! taken. Each rule that gives it there leads to a state where its own needs are wanted instead; each edge
//! ([`domain`](super::domain)) to one where the quantity is wanted in the domain that the edge comes from. So the search
//! decides where a quantity is computed as it decides how: a rule costs its operations times how often its domain is
//! evaluated ([`Work`](super::domain::Work)), an edge what it takes to bring the quantity over. As needs always lie
//! nearer to the inputs, no quantity is decided upon twice. A rule that gives several quantities pays once.
//! A state's least cost is the sum, over what it still wants, of the cheapest rule's share: never more than
//! the true cost, so the first solution found is the best.

use pathfinding::directed::astar::astar;

use super::bits::Bits;
use super::domain::Domain;
use super::facts::{Budget, Facts};
pub use super::graph::Carried;
use super::graph::{Graph, Means};
use super::rule::Rule;
use super::term;
use crate::model::effects::{Effect, Effects};

/// Costs and errors in the search are whole numbers: so many to one.
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
    /// More quantities than a search tells apart.
    #[error(
        "{quantities} shader quantities are more than the {most} that a search tells apart. Enable fewer effects."
    )]
    TooMany {
        /// Quantities of the scene's rules.
        quantities: usize,
        /// What the search tells apart.
        most: usize,
    },
    /// Quantities of an atlas where there is none.
    #[error(
        "the effect {effect} is computed in texels of the UV atlas, which exports, maps' fits, samples made on an adapter and meshes without texture coordinates do not have. Leave the effect out there, or have the CPU make the samples."
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
        Self::OfRays { field: field.to_owned() }
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
    let no_plan = || match term::of_texels(facts.setup.effects) {
        Some(_) if facts.holds("atlas") != Some(true) => PlanError::no_atlas(facts.setup.effects),
        _ => PlanError::NoPlan { goals: [vertex_goals, goals].concat().join(", ") },
    };
    let mut start = State { open: Bits::default(), have: Bits::default(), error: 0 };
    let wanted = vertex_goals.iter().map(|q| (Domain::Vertex, *q));
    for want in wanted.chain(goals.iter().map(|q| (Domain::Fragment, *q))) {
        start.open = start.open.or(graph.bit(want).ok_or_else(no_plan)?);
    }
    let (path, _) = astar(
        &start,
        |state| graph.successors(state),
        |state| graph.least(state.open),
        |s| s.open.is_empty(),
    )
    .ok_or_else(no_plan)?;
    let mut found = Found::default();
    for means in path.windows(2).filter_map(|pair| graph.between(pair)) {
        match means {
            Means::Rule(rule) => found.rules.push(rule),
            Means::Edge(carried) => found.carried.push(carried),
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

impl Graph<'_> {
    /// A means' cost in whole steps.
    fn steps(&self, means: &Means) -> u64 {
        (self.cost(means) * COST_STEPS).round() as u64
    }

    /// The open want that lies furthest from the inputs.
    fn next(&self, state: &State) -> Option<usize> {
        state.open.greatest()
    }

    fn successors(&self, state: &State) -> Vec<(State, u64)> {
        let Some(at) = self.next(state) else { return Vec::new() };
        self.means(at).iter().filter_map(|means| self.step(state, at, means)).collect()
    }

    fn step(&self, state: &State, at: usize, means: &Means) -> Option<(State, u64)> {
        let gives = self.gives(means, Bits::one(at));
        let have = state.have.or(gives);
        let open = state.open.or(self.needs(means)?).without(have);
        // What lies beyond is never wanted again: forgetting it makes more states alike.
        let have = have.below(at);
        let error = (self.error(means) * ERROR_STEPS).ceil() as u64;
        let error = match self.facts.budget {
            Budget::Within(most) => {
                let sum = state.error + error;
                (sum as f64 <= most * ERROR_STEPS + 0.5).then_some(sum)?
            }
            // Told by each rule's `refusal`; states that differ by it alone are the same.
            Budget::Exact | Budget::Paper => 0,
        };
        Some((State { open, have, error }, self.steps(means)))
    }

    /// A bound on what the open wants cost at the least.
    fn least(&self, open: Bits) -> u64 {
        let cheapest = |at: usize| {
            let share =
                |means: &Means| self.steps(means) / u64::from(self.gives(means, Bits::one(at)).count());
            self.means(at).iter().map(share).min().unwrap_or(0)
        };
        open.iter().map(cheapest).sum()
    }

    /// The means that leads from one state of a path to the next.
    fn between(&self, pair: &[State]) -> Option<Means> {
        let at = self.next(&pair[0])?;
        let taken = self.means(at).iter().filter_map(|means| Some((means, self.step(&pair[0], at, means)?)));
        // Of means that lead to the same state the path's cost chose the cheapest.
        let (means, _) =
            taken.filter(|(_, (state, _))| *state == pair[1]).min_by_key(|(_, (_, cost))| *cost)?;
        Some(*means)
    }
}
