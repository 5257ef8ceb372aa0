//! The cheapest set of rules that yields what is wanted, within the accuracy budget: A*, backwards from
//! the goal.
//!
//! A state is what is still wanted. Of that, the quantity that lies furthest from the inputs is taken, and
//! each rule that gives it leads to a state where its own needs are wanted instead; as needs always lie
//! nearer to the inputs, no quantity is decided upon twice. A rule that gives several quantities pays once.
//! A state's least cost is the sum, over what it still wants, of the cheapest rule's share: never more than
//! the true cost, so the first solution found is the best.

use std::collections::BTreeMap;

use pathfinding::directed::astar::astar;

use super::bits::Bits;
use super::facts::{Budget, Facts};
use super::quantity::{Attribute, Constant};
use super::rule::{Rule, Stage, rules};

/// How much work a vertex counts beside a fragment: a character's mesh has about a vertex for every four
/// pixels that it covers.
pub const VERTEX_SHARE: f64 = 0.25;
/// Operations that interpolating a number takes.
pub const INTERPOLATION_COST: f64 = 1.0;

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
    /// Quantities that need one another.
    #[error(
        "shader rules need one another in a circle, among {goals}. This is a fault of skinfit: please report it."
    )]
    Circle {
        /// Among which.
        goals: String,
    },
}

/// A wanted quantity, and the stage where it is wanted.
type Want = (Stage, &'static str);

/// What a rule, or the rasteriser, does in the graph of quantities.
#[derive(Clone, Debug)]
enum Means {
    Rule(&'static Rule),
    /// Interpolation of a quantity of the vertex stage, of so many components.
    Interpolate(&'static str, usize),
}

/// The graph of all quantities under one set of facts.
struct Graph<'a> {
    facts: &'a Facts,
    /// The wants, by rank: what lies further from the inputs has the greater number.
    wants: Vec<Want>,
    /// For each want, the means that give it.
    means: Vec<Vec<Means>>,
    given: &'a [&'static str],
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

/// The rules that yield `goals` in the fragment stage (and `vertex_goals` in the vertex stage) at the
/// least cost, in an order in which they can be evaluated, the vertex stage first.
///
/// `given` quantities of the fragment stage are there already.
///
/// # Errors
/// When there are none.
pub fn search(
    facts: &Facts,
    vertex_goals: &[&'static str],
    goals: &[&'static str],
    given: &[&'static str],
) -> Result<Vec<&'static Rule>, PlanError> {
    let graph = Graph::new(facts, given)?;
    let no_plan = || PlanError::NoPlan { goals: [vertex_goals, goals].concat().join(", ") };
    let mut start = State { open: Bits::default(), have: Bits::default(), error: 0 };
    let wanted = vertex_goals.iter().map(|q| (Stage::Vertex, *q));
    for want in wanted.chain(goals.iter().map(|q| (Stage::Fragment, *q))) {
        start.open = start.open.or(graph.bit(want).ok_or_else(no_plan)?);
    }
    let (path, _) = astar(
        &start,
        |state| graph.successors(state),
        |state| graph.least(state.open),
        |s| s.open.is_empty(),
    )
    .ok_or_else(no_plan)?;
    let mut rules: Vec<&'static Rule> = path.windows(2).filter_map(|pair| graph.between(pair)).collect();
    rules.reverse();
    rules.sort_by_key(|rule| rule.stage);
    Ok(rules)
}

/// Whether a quantity is there without any rule: an attribute, a constant, or the vertex' index.
fn is_input(quantity: &str) -> bool {
    quantity == "vertex_index"
        || Attribute::ALL.iter().any(|attribute| attribute.name() == quantity)
        || Constant::from_name(quantity).is_some()
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

impl<'a> Graph<'a> {
    fn new(facts: &'a Facts, given: &'a [&'static str]) -> Result<Self, PlanError> {
        let mut means: BTreeMap<Want, Vec<Means>> = BTreeMap::new();
        let usable = || rules(facts.setup.effects).filter(|rule| rule.refusal(facts).is_none());
        for rule in usable() {
            for (quantity, swizzle) in &rule.gives {
                means.entry((rule.stage, quantity)).or_default().push(Means::Rule(rule));
                if rule.stage == Stage::Vertex {
                    let size = if swizzle.is_empty() { components(rule.returns) } else { swizzle.len() };
                    let interpolate = means.entry((Stage::Fragment, quantity)).or_default();
                    if interpolate.is_empty() {
                        interpolate.push(Means::Interpolate(quantity, size));
                    }
                }
            }
        }
        let ranks = ranks(&means, given)?;
        let mut wants: Vec<Want> = means.keys().copied().collect();
        wants.retain(|want| ranks.contains_key(want));
        wants.sort_by_key(|want| (ranks[want], *want));
        if wants.len() > Bits::MOST {
            return Err(PlanError::TooMany { quantities: wants.len(), most: Bits::MOST });
        }
        let means = wants.iter().map(|want| means.remove(want).unwrap_or_default()).collect();
        Ok(Self { facts, wants, means, given })
    }

    fn bit(&self, want: Want) -> Option<Bits> {
        self.wants.iter().position(|&w| w == want).map(Bits::one)
    }

    fn is_given(&self, (stage, quantity): Want) -> bool {
        is_input(quantity) || (stage == Stage::Fragment && self.given.contains(&quantity))
    }

    /// The wants of a means; `None` when one of them cannot be met.
    fn needs(&self, means: &Means) -> Option<Bits> {
        let needs: Vec<Want> = match means {
            Means::Rule(rule) => rule.needs.iter().map(|(q, _)| (rule.stage, *q)).collect(),
            Means::Interpolate(quantity, _) => vec![(Stage::Vertex, *quantity)],
        };
        needs
            .into_iter()
            .filter(|&want| !self.is_given(want))
            .try_fold(Bits::default(), |bits, want| Some(bits.or(self.bit(want)?)))
    }

    fn cost(&self, means: &Means) -> u64 {
        let cost = match means {
            Means::Rule(rule) if rule.stage == Stage::Vertex => VERTEX_SHARE * rule.cost(self.facts),
            Means::Rule(rule) => rule.cost(self.facts),
            Means::Interpolate(_, components) => INTERPOLATION_COST * *components as f64,
        };
        (cost * COST_STEPS).round() as u64
    }

    /// All that a means gives.
    fn gives(&self, means: &Means, want: Bits) -> Bits {
        match means {
            Means::Rule(rule) => {
                rule.gives.iter().filter_map(|(q, _)| self.bit((rule.stage, q))).fold(want, Bits::or)
            }
            Means::Interpolate(..) => want,
        }
    }

    /// The open want that lies furthest from the inputs.
    fn next(&self, state: &State) -> Option<usize> {
        state.open.greatest()
    }

    fn successors(&self, state: &State) -> Vec<(State, u64)> {
        let Some(at) = self.next(state) else { return Vec::new() };
        self.means[at].iter().filter_map(|means| self.step(state, at, means)).collect()
    }

    fn step(&self, state: &State, at: usize, means: &Means) -> Option<(State, u64)> {
        let gives = self.gives(means, Bits::one(at));
        let have = state.have.or(gives);
        let open = state.open.or(self.needs(means)?).without(have);
        // What lies beyond is never wanted again: forgetting it makes more states alike.
        let have = have.below(at);
        let error = match means {
            Means::Rule(rule) => (rule.error(self.facts) * ERROR_STEPS).ceil() as u64,
            Means::Interpolate(..) => 0,
        };
        let error = match self.facts.budget {
            Budget::Within(most) => {
                let sum = state.error + error;
                (sum as f64 <= most * ERROR_STEPS + 0.5).then_some(sum)?
            }
            // Told by each rule's `refusal`; states that differ by it alone are the same.
            Budget::Exact | Budget::Paper => 0,
        };
        Some((State { open, have, error }, self.cost(means)))
    }

    /// A bound on what the open wants cost at the least.
    fn least(&self, open: Bits) -> u64 {
        let cheapest = |at: usize| {
            let share =
                |means: &Means| self.cost(means) / u64::from(self.gives(means, Bits::one(at)).count());
            self.means[at].iter().map(share).min().unwrap_or(0)
        };
        open.iter().map(cheapest).sum()
    }

    /// The rule that leads from one state of a path to the next.
    fn between(&self, pair: &[State]) -> Option<&'static Rule> {
        let at = self.next(&pair[0])?;
        let taken = self.means[at].iter().filter_map(|means| Some((means, self.step(&pair[0], at, means)?)));
        // Of rules that lead to the same state the path's cost chose the cheapest.
        let (means, _) =
            taken.filter(|(_, (state, _))| *state == pair[1]).min_by_key(|(_, (_, cost))| *cost)?;
        match means {
            Means::Rule(rule) => Some(rule),
            Means::Interpolate(..) => None,
        }
    }
}

/// How far each want lies from the inputs: one more than the furthest of its needs, over all means. Wants
/// that cannot be met have no rank.
fn ranks(
    means: &BTreeMap<Want, Vec<Means>>,
    given: &[&'static str],
) -> Result<BTreeMap<Want, usize>, PlanError> {
    let mut ranks: BTreeMap<Want, usize> = BTreeMap::new();
    let there = |(stage, q): Want| is_input(q) || (stage == Stage::Fragment && given.contains(&q));
    // Each round settles at least one more; cycles would never end, so rounds are counted.
    for _ in 0..=means.len() {
        let mut changed = false;
        for (want, ways) in means {
            let rank = ways.iter().filter_map(|way| {
                let needs: Vec<Want> = match way {
                    Means::Rule(rule) => rule.needs.iter().map(|(q, _)| (rule.stage, *q)).collect(),
                    Means::Interpolate(quantity, _) => vec![(Stage::Vertex, *quantity)],
                };
                needs
                    .into_iter()
                    .filter(|&need| !there(need))
                    .try_fold(0, |rank: usize, need| Some(rank.max(ranks.get(&need)? + 1)))
            });
            if let Some(rank) = rank.max()
                && ranks.get(want) != Some(&rank)
            {
                ranks.insert(*want, rank);
                changed = true;
            }
        }
        if !changed {
            return Ok(ranks);
        }
    }
    let goals = means.keys().map(|(_, quantity)| *quantity).collect::<Vec<_>>().join(", ");
    Err(PlanError::Circle { goals })
}
