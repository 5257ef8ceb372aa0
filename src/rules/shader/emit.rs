//! A plan: the chosen rules, the passes that go before, and what they read.

use super::atlas::{self, Level, Pass};
use super::domain::{CHART, Domain};
use super::facts::{Facts, Source};
use super::kept::kept_fields;
use super::quantity::{Attribute, Constant, Resource};
use super::rule::{Rule, rules};
use super::search::{Carried, PlanError, search};
use super::term;
use crate::model::terms::TermName;

/// The shader that a scene gets.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What it was made for.
    pub facts: Facts,
    /// The chosen rules of the module, in the order of their evaluation, the vertex stage first. Rules of texels are
    /// steps of [`passes`](Self::passes).
    pub steps: Vec<Step>,
    /// Passes over the UV atlas that go before, in their order.
    pub passes: Vec<Pass>,
    /// Vertex attributes; the shader location is the place in this list.
    pub attributes: Vec<Attribute>,
    /// What is bound in group 0; the binding is 1 + the place in this list.
    pub resources: Vec<Resource>,
    /// The members of the uniform block at binding 0, in its order.
    pub constants: Vec<Constant>,
    /// Textures of the atlas that it reads, bound in group 0 after the resources, in this order. Of stored samples: what
    /// was looked up of them, fields of those names.
    pub levels: Vec<Level>,
    /// Quantities that the rasteriser interpolates, or stored texels hold, with their WGSL types.
    pub varyings: Vec<(&'static str, &'static str)>,
    /// The module; `vs_main` and `fs_main` are its entry points, or `shade` its function.
    pub wgsl: String,
    /// Operations a fragment, about: vertices and texels by [their work](super::domain::Work), passes with them.
    pub cost: f64,
    /// How far the output may be off, relative to white.
    pub error: f64,
    /// Whether fragments fetch what they read and do nothing else.
    pub only_fetches: bool,
}

/// One chosen rule.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// The rule.
    pub rule: &'static Rule,
    /// Operations.
    pub cost: f64,
    /// How far it is off, relative to white.
    pub error: f64,
}

/// What the fragment stage reads of a stored sample, `model::fragment::Fragment`'s fields, with their WGSL
/// types.
pub const SAMPLE: [(&str, &str); 10] = [
    ("base", "vec3f"),
    ("bump", "vec3f"),
    ("normal", "vec3f"),
    ("view", "vec3f"),
    ("open", "f32"),
    ("silhouette", "f32"),
    ("dapple", "f32"),
    ("albedo", "vec3f"),
    ("specular", "f32"),
    ("attenuator", "f32"),
];

/// What a stored sample may hold beside, from which a rule makes what [`SAMPLE`] holds ready made.
pub const UNMADE: [(&str, &str); 3] =
    [("dapple_normal", "vec3f"), ("corner_silhouettes", "vec3f"), ("corner_shares", "vec3f")];

/// What the rules of texels read of a stored texel, with WGSL types: what vertices have that no eye moves, and the maps
/// there.
pub const TEXEL: [(&str, &str); 10] = [
    ("vertex_position", "vec3f"),
    ("vertex_normal", "vec3f"),
    ("vertex_tangent", "vec3f"),
    ("vertex_bitangent", "vec3f"),
    ("vertex_uv", "vec2f"),
    ("vertex_occlusion", "f32"),
    ("albedo", "vec3f"),
    ("specular", "f32"),
    ("attenuator", "f32"),
    ("normal_texel", "vec3f"),
];

/// What stored texels may hold; nothing where there are none.
pub(super) fn texel_fields(facts: &Facts) -> Fields {
    let stored = facts.source == Source::Samples && facts.holds("atlas") == Some(true);
    if stored { TEXEL.into_iter().chain(of_vertices(facts)).collect() } else { Fields::new() }
}

/// What files of rules have declared of vertices and maps, of the effects that `facts` call for.
pub(super) fn of_vertices(facts: &Facts) -> impl Iterator<Item = (&'static str, &'static str)> {
    term::fields(facts.setup.effects).iter().map(|field| (field.name(), field.wgsl()))
}

/// The cheapest shader that yields what `facts` call for.
///
/// # Errors
/// When no rules yield it within the budget.
pub fn plan(facts: &Facts) -> Result<Plan, PlanError> {
    let parts = parts(facts);
    let mut goals = parts.clone();
    if hazy(facts) {
        goals.push("haze");
    }
    match facts.source {
        Source::Raster => {
            let plan = Plan::search(facts, &["clip"], &goals, &[])?;
            let wgsl = plan.raster_module();
            Ok(Plan { wgsl, ..plan })
        }
        Source::Samples | Source::Terms => {
            let mut given: Vec<&'static str> = sample_fields(facts).iter().map(|(name, _)| *name).collect();
            // By these are levels looked up, and what was found is handed to the shader.
            if facts.holds("atlas") == Some(true) {
                given.extend([facts.atlas_uv(), CHART]);
            }
            let plan = Plan::search(facts, &[], &goals, &given)?;
            let wgsl = plan.sample_module(&parts);
            Ok(Plan { wgsl, ..plan })
        }
    }
}

/// Fields of a stored sample, with their WGSL types.
pub type Fields = Vec<(&'static str, &'static str)>;

/// The fields of a stored sample, or of its terms, that a scene's effects ask for.
#[must_use]
pub fn sample_fields(facts: &Facts) -> Fields {
    if facts.source == Source::Terms {
        return kept_fields(facts);
    }
    let needs = facts.needs();
    let bumped_silhouette = facts.holds("bumped_silhouette") == Some(true);
    let (turning, corners) = (facts.setup.dapple.turns(), facts.setup.rim_of_corners());
    let wanted = |name: &str| match name {
        "bump" => needs.normal_map,
        "normal" => needs.smooth_normal,
        "open" => needs.occlusion,
        "silhouette" => needs.rim && !bumped_silhouette && !corners,
        "corner_silhouettes" | "corner_shares" => needs.rim && corners,
        "dapple" => needs.dapple && !turning,
        "dapple_normal" => needs.dapple && turning,
        "albedo" => needs.color_map,
        "specular" => needs.specular_map,
        "attenuator" => needs.attenuator_map,
        _ => true,
    };
    let built_in = SAMPLE.into_iter().chain(UNMADE).filter(|(name, _)| wanted(name));
    built_in.chain(needs.fields.iter().map(|field| (field.name(), field.wgsl()))).collect()
}

/// Whether the haze goes to alpha.
pub fn hazy(facts: &Facts) -> bool {
    facts.needs().haze && facts.output.is_none()
}

/// Radiance and haze, or how they move, as one vector. Of neither a zero by itself: naga makes a constant of
/// `vec4f(vec3f(), 0.0)` whose constituents are not scalars, which SPIR-V does not allow (OpConstantComposite) and drivers
/// refuse.
pub fn with_haze(radiance: Option<&str>, haze: Option<&str>) -> String {
    match (radiance, haze) {
        (None, None) => "vec4f()".to_owned(),
        _ => format!("vec4f({}, {})", radiance.unwrap_or("vec3f()"), haze.unwrap_or("0.0")),
    }
}

/// What a plan shows as one vector: the sum of its parts, and the haze.
pub fn shown(facts: &Facts) -> String {
    let sum = parts(facts).join(" + ");
    with_haze((!sum.is_empty()).then_some(&*sum), hazy(facts).then_some("haze"))
}

/// The parts that add up to the output, in the order of their terms.
pub fn parts(facts: &Facts) -> Vec<&'static str> {
    let terms = TermName::of(facts.setup.effects);
    // What holds several terms is shown term by term by other rules.
    let holds = |rule: &Rule| match facts.output {
        None => rule.adds.iter().filter_map(|name| terms.iter().position(|term| term.name() == *name)).min(),
        Some(term) => {
            let alone = rule.shows == Some(term.name()) || rule.adds.as_slice() == [term.name()];
            (alone && terms.contains(&term)).then_some(0)
        }
    };
    let mut parts: Vec<(usize, &'static str)> =
        rules(facts.setup.effects).filter_map(|rule| Some((holds(rule)?, rule.gives[0].0))).collect();
    parts.sort_by_key(|(place, _)| *place);
    parts.dedup();
    parts.into_iter().map(|(_, part)| part).collect()
}

impl Plan {
    /// Search for the rules, and list what they read; the module is left empty.
    pub fn search(
        facts: &Facts,
        vertex_goals: &[&'static str],
        goals: &[&'static str],
        given: &[&'static str],
    ) -> Result<Self, PlanError> {
        let found = search(facts, vertex_goals, goals, given)?;
        let passes = atlas::passes(facts, &found)?;
        if passes.is_empty() {
            return Ok(Self::of_rules(facts, &found.rules, &found.carried, Vec::new()));
        }
        let of_fragments = |rule: &&&'static Rule| rule.domain == Domain::Fragment;
        let fragments: Vec<&'static Rule> = found.rules.iter().filter(of_fragments).copied().collect();
        let goals = [vertex_goals, &[facts.atlas_uv(), CHART]].concat();
        let rules = atlas::with_vertices(&found, Domain::Fragment, &goals, fragments);
        let levels = atlas::looked_up(facts, &found.carried);
        let mut plan = Self::of_rules(facts, &rules, &found.carried, levels);
        plan.cost += passes.iter().map(|pass| pass.plan.cost).sum::<f64>();
        plan.error = found.rules.iter().map(|rule| rule.error(facts)).sum::<f64>()
            + found.carried.iter().map(|on| on.error).sum::<f64>();
        plan.passes = passes;
        Ok(plan)
    }

    /// What rules of vertices and of one other domain read; the module is left empty. `levels` are bound.
    pub(super) fn of_rules(
        facts: &Facts,
        rules: &[&'static Rule],
        carried: &[Carried],
        levels: Vec<Level>,
    ) -> Self {
        let arrives = |domain: Domain, quantity: &str| {
            let on = carried.iter().find(|on| on.edge.to == domain && on.quantity == quantity);
            on.filter(|on| on.edge.from == Domain::Vertex)
        };
        let shading = || rules.iter().filter(|rule| rule.domain != Domain::Vertex && rule.blur.is_none());
        let mut varyings: Vec<(&'static str, &'static str)> = Vec::new();
        let mut interpolated = 0.0;
        let needs = shading().flat_map(|rule| rule.needs.iter().map(|need| (rule.domain, *need)));
        // Fragments look levels up by their texture coordinates in the atlas.
        let looks_up = !levels.is_empty() && shading().all(|rule| rule.domain == Domain::Fragment);
        let by = [(Domain::Fragment, (facts.atlas_uv(), "vec2f")), (Domain::Fragment, (CHART, "f32"))];
        let by = by.into_iter().filter(|_| looks_up);
        let stored = texel_fields(facts);
        for (domain, (quantity, kind)) in needs.chain(by) {
            if varyings.iter().any(|varying| varying.0 == quantity) {
                continue;
            }
            if domain == Domain::Texel && stored.iter().any(|(name, _)| *name == quantity) {
                varyings.push((quantity, kind));
            } else if let Some(on) = arrives(domain, quantity) {
                varyings.push((quantity, kind));
                interpolated += on.cost(facts);
            }
        }
        let looked_up = carried.iter().filter(|on| on.edge.from == Domain::Texel && looks_up);
        let needed = |name: &str| rules.iter().any(|rule| rule.needs.iter().any(|(q, _)| *q == name));
        let read = |name: &str| rules.iter().any(|rule| rule.reads.contains(&name));
        let params = crate::model::params::Param::all().map(Constant::Param);
        let constants: Vec<Constant> = Constant::OWN
            .into_iter()
            .chain(params)
            .filter(|constant| needed(constant.name()) || read(constant.name()))
            .collect();
        let steps: Vec<Step> = rules
            .iter()
            .map(|&rule| Step { rule, cost: rule.cost(facts), error: rule.error(facts) })
            .collect();
        let share = |step: &Step| facts.work.share(step.rule.domain) * step.cost;
        Self {
            facts: *facts,
            attributes: Attribute::all(facts.setup.effects).filter(|a| needed(a.name())).collect(),
            resources: Resource::all().filter(|r| read(r.name())).collect(),
            constants,
            varyings,
            levels,
            passes: Vec::new(),
            wgsl: String::new(),
            only_fetches: false,
            cost: steps.iter().map(share).sum::<f64>()
                + (interpolated + looked_up.map(|on| on.cost(facts)).sum::<f64>()),
            error: steps.iter().map(|step| step.error).sum(),
            steps,
        }
    }

    /// Every chosen rule, each once: those of the passes over the atlas, then those of the image.
    #[must_use]
    pub fn all_steps(&self) -> Vec<&Step> {
        let mut all: Vec<&Step> = Vec::new();
        for step in self.passes.iter().flat_map(|pass| &pass.plan.steps).chain(&self.steps) {
            if !all.iter().any(|known| std::ptr::eq(known.rule, step.rule)) {
                all.push(step);
            }
        }
        all
    }

    /// Whether the module computes in 16 bits.
    #[must_use]
    pub fn uses_f16(&self) -> bool {
        self.steps.iter().any(|step| step.rule.when.contains(&"f16"))
    }

    /// Every rule that was left out, and why.
    #[must_use]
    pub fn left_out(&self) -> Vec<(&'static Rule, String)> {
        let all = self.all_steps();
        let chosen = |rule: &Rule| all.iter().any(|step| std::ptr::eq(step.rule, rule));
        let same = |step: &Step, rule: &Rule, q: &str| {
            step.rule.domain == rule.domain && step.rule.gives_quantity(q)
        };
        let given = |rule: &Rule| rule.gives.iter().any(|(q, _)| all.iter().any(|step| same(step, rule, q)));
        // Where there is no atlas its rules are no choice.
        let atlas = self.facts.holds("atlas") == Some(true);
        let choice = |rule: &&Rule| atlas || rule.domain != Domain::Texel;
        let why = |rule: &Rule| match rule.refusal(&self.facts) {
            Some(reason) => reason,
            None if given(rule) => "dearer".to_owned(),
            None => "nothing asks for it".to_owned(),
        };
        let left = rules(self.facts.setup.effects).filter(choice).filter(|rule| !chosen(rule));
        left.map(|rule| (rule, why(rule))).collect()
    }
}
