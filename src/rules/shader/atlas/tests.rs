//! A term whose light is computed in texels and blurred there.

use std::sync::OnceLock;

use naga::valid::{Capabilities, ValidationFlags, Validator};

use super::tangent::Along;
use super::*;
use crate::model::diffusion::{DiffusionChoices, Lookup, Method, Seams};
use crate::model::effects::{Effect, Effects, Form, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::params::Param;
use crate::model::texture_filter::TextureFilter;
use crate::shader::domain::Work;
use crate::shader::facts::{Budget, MapFacts, Source};
use crate::shader::quantity::Attribute;
use crate::shader::tangent::chain::Seed;
use crate::shader::term::{Problem, Term, library, register};
use crate::shader::{Resource, plan};

/// Two blurs, one after the other, of a light map; how far they reach depends on how the map is stretched.
const MIST: &str = "\
// Light that wanders under the skin.
//
// effect: mist, light under the skin
// parameter: mist_weight = 0.5 in [0, inf), rgb, linear; weight of the wide level; a test
// parameter: mist_radius = 2 in [0.1, 30]; standard deviation of a blur; a test
//
// gives: mist_light
// domain: texel
// cost: 3
fn mist_light_map(albedo: vec3f, irradiance: vec3f, occ: f32) -> vec3f {
    return albedo * irradiance * occ;
}

// gives: mist_stretch
// domain: texel
// cost: 20
fn mist_stretch_map(vertex_position: vec3f) -> vec2f {
    let along: vec3f = dpdx(vertex_position);
    let down: vec3f = dpdy(vertex_position);
    return sqrt(vec2f(dot(along, along), dot(down, down)));
}

// gives: mist_near
// domain: texel
// pass: mist_light: vec3f, 7 taps
// sampled: 0
// cost: 8
fn mist_near_kernel(tap: f32, axis: vec2f, mist_radius: f32, mist_stretch: vec2f) -> vec2f {
    let step: f32 = dot(mist_stretch, axis);
    let sigma: f32 = select(0.0, mist_radius / step, step > 0.0);
    return vec2f(tap * sigma, exp(-0.5 * tap * tap));
}

// gives: mist_lit
// domain: texel
// cost: 3
fn mist_lit_again(mist_near: vec3f, albedo: vec3f) -> vec3f {
    return mist_near * albedo;
}

// gives: mist_far
// domain: texel
// pass: mist_lit: vec3f, 5 taps
// sampled: 0
// cost: 4
fn mist_far_kernel(tap: f32) -> vec2f {
    return vec2f(tap, exp(-0.5 * tap * tap));
}

// gives: mist_part
// adds: mist
// cost: 6
fn mist(mist_near: vec3f, mist_far: vec3f, mist_weight: vec3f) -> vec3f {
    return mist_near + mist_weight * mist_far;
}
";

fn term() -> &'static Term {
    static TERM: OnceLock<&'static Term> = OnceLock::new();
    TERM.get_or_init(|| register("mist", MIST).unwrap_or_else(|error| panic!("{error}")))
}

fn facts(effects: Effects) -> Facts {
    let setup = Setup::new(Form::Corrected, Silhouette::Fragment, effects.with(term().effect));
    Facts { setup, atlas: Some(512), ..Facts::default() }
}

fn validate(plan: &Plan) {
    let valid = naga::front::wgsl::parse_str(&plan.wgsl)
        .map_err(|error| error.emit_to_string(&plan.wgsl))
        .and_then(|module| {
            let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
            validator.validate(&module).map_err(|error| error.emit_to_string(&plan.wgsl))
        });
    assert!(valid.is_ok(), "{}\n{}", valid.unwrap_err(), plan.wgsl);
}

fn names(levels: &[Level]) -> Vec<&str> {
    levels.iter().map(|level| level.name.as_str()).collect()
}

#[test]
fn passes_leave_what_later_ones_read_and_nothing_else() {
    let plan = plan(&facts(Effects::of(&[Effect::Diffuse, Effect::Occlusion]))).unwrap();
    let left: Vec<Vec<&str>> = plan.passes.iter().map(|pass| names(&pass.leaves)).collect();
    let order = [
        vec!["mist_stretch", "mist_light"],
        vec!["mist_near_along_u"],
        vec!["mist_near"],
        vec!["mist_lit"],
        vec!["mist_far_along_u"],
        vec!["mist_far"],
    ];
    assert_eq!(left, order);
    let kinds: Vec<PassKind> = plan.passes.iter().map(|pass| pass.kind).collect();
    let (u, v) = (PassKind::Blur(Axis::U), PassKind::Blur(Axis::V));
    assert_eq!(kinds, [PassKind::Draw, u, v, PassKind::Draw, u, v]);
    let read: Vec<Vec<&str>> = plan.passes.iter().map(|pass| names(&pass.plan.levels)).collect();
    let order = [
        vec![],
        vec!["mist_light", "mist_stretch"],
        vec!["mist_near_along_u", "mist_stretch"],
        vec!["mist_near"],
        vec!["mist_lit"],
        vec!["mist_far_along_u"],
    ];
    assert_eq!(read, order);
    assert_eq!(names(&plan.levels), ["mist_near", "mist_far"]);
    // The second draw lights nothing: it reads the colour map and what was blurred.
    let [first, .., second, _, _] = plan.passes.as_slice() else { panic!("{left:?}") };
    assert!(first.plan.resources.contains(&Resource::IrradianceFaces));
    assert_eq!(second.plan.resources, [Resource::ColorTexels]);
    // The image's own shader has none of the texels' functions.
    assert!(!plan.wgsl.contains("fn mist_light_map(") && !plan.wgsl.contains("fn mist_near_kernel("));
    assert!(plan.wgsl.contains("level_corners(mist_near_level, at.vertex_uv, round(at.vertex_chart))"));
    assert!(plan.wgsl.contains("level_at(mist_near_level, corners).xyz"));
}

#[test]
fn every_pass_is_valid_in_every_kind_of_scene() {
    let exact = facts(Effects::SURFACE);
    let bare = MapFacts::default();
    let listing = Setup { form: Form::Listing, ..exact.setup };
    for facts in [
        exact,
        facts(Effects::default()),
        facts(Effects::of(&[Effect::Reflection])),
        Facts { maps: bare, turned: true, ..exact },
        Facts { morphs: 2, bones: true, budget: Budget::Within(0.02), ..exact },
        Facts { budget: Budget::Paper, f16: true, ..facts(Effects::of(&[Effect::Occlusion])) },
        Facts { setup: listing, ..exact },
        Facts { maps: bare, setup: listing, ..exact },
        Facts { source: Source::Samples, ..exact },
        Facts { source: Source::Samples, setup: listing, turned: true, ..exact },
    ] {
        let plan = plan(&facts).unwrap();
        validate(&plan);
        assert_eq!(plan.passes.len(), 6, "{facts:?}");
        for pass in &plan.passes {
            validate(&pass.plan);
            // Nobody sees a texel.
            assert!(!pass.plan.wgsl.contains("eye") && !pass.plan.wgsl.contains("view_projection"));
        }
    }
}

#[test]
fn levels_are_looked_up_by_the_atlas_own_coordinates_and_maps_by_theirs() {
    let one = facts(Effects::of(&[Effect::Diffuse, Effect::Occlusion]));
    let by = |uv: &str| format!("level_corners(mist_near_level, at.{uv}, round(at.vertex_chart))");
    for filter in [TextureFilter::Bilinear, TextureFilter::Trilinear, TextureFilter::Anisotropic] {
        for budget in [Budget::Exact, Budget::Paper] {
            let maps = MapFacts { filter, ..one.maps };
            let planned = plan(&Facts { maps, budget, own_atlas_uvs: true, ..one }).unwrap();
            validate(&planned);
            planned.passes.iter().for_each(|pass| validate(&pass.plan));
            assert!(planned.wgsl.contains(&by("vertex_atlas_uv")));
            let first = &planned.passes[0].plan;
            assert!(
                first.attributes.contains(&Attribute::Uv) && first.attributes.contains(&Attribute::AtlasUv)
            );
            // A texel covers of maps what the triangle says.
            assert_eq!(first.wgsl.contains("vertex_uv_along_u"), filter.reads_levels());
        }
    }
    let planned = plan(&one).unwrap();
    assert!(planned.wgsl.contains(&by("vertex_uv")));
    assert!(planned.passes.iter().all(|pass| !pass.plan.wgsl.contains("atlas_uv")));
}

#[test]
fn a_blurs_tangent_is_the_same_pass_over_the_tangent_level() {
    let plan = plan(&facts(Effects::of(&[Effect::Occlusion]))).unwrap();
    let along = |param| Along::new(&plan, &Seed::of_param(param)).unwrap();
    let left = |along: &Along| -> Vec<String> {
        along.passes.iter().flat_map(|pass| &pass.leaves).map(|level| level.name.clone()).collect()
    };
    let all = ["mist_light", "mist_near_along_u", "mist_near", "mist_lit", "mist_far_along_u", "mist_far"];
    let all = all.map(|name| format!("d_{name}"));
    // The light map moves with the occlusion, and all that is made of it; the stretch does not.
    let occlusion = along(Param::Occlusion);
    assert_eq!(left(&occlusion), all);
    for (tangent, pass) in occlusion.passes.iter().zip(&plan.passes) {
        validate(&tangent.plan);
        if let PassKind::Blur(_) = pass.kind {
            let source = &pass.plan.levels[0].name;
            let renamed = pass.plan.wgsl.replace(&format!("{source}_level"), &format!("d_{source}_level"));
            assert_eq!(tangent.plan.wgsl, renamed);
        }
    }
    // The radius moves the first blur's kernel, and what is made of it; the second blur is linear in that.
    let radius = along(term().params[1]);
    assert_eq!(left(&radius), all[1..]);
    radius.passes.iter().for_each(|pass| validate(&pass.plan));
    assert!(radius.passes[0].plan.wgsl.contains("mist_near_kernel_"));
    assert!(!radius.passes[3].plan.wgsl.contains("change"));
    // No level moves with the weight of one.
    assert!(along(term().params[0]).passes.is_empty());
}

#[test]
fn without_an_atlas_the_effect_is_refused_and_others_have_no_passes() {
    let effect = term().effect.name();
    let without = facts(Effects::default());
    for facts in [
        Facts { atlas: None, ..without },
        Facts { atlas: None, source: Source::Samples, ..without },
        Facts { atlas: None, source: Source::Terms, ..without },
    ] {
        assert_eq!(plan(&facts).unwrap_err(), PlanError::NoAtlas { effect });
    }
    let setup = Setup { effects: Effects::SURFACE, ..without.setup };
    let with = plan(&Facts { setup, budget: Budget::Within(0.1), ..without }).unwrap();
    let plain = plan(&Facts { atlas: None, ..with.facts }).unwrap();
    assert!(with.passes.is_empty() && with.wgsl == plain.wgsl && with.cost == plain.cost);
}

#[test]
fn what_the_effect_asks_for_is_what_its_texels_read() {
    let needs = Effects::of(&[term().effect, Effect::Occlusion]).needs(Silhouette::Fragment);
    assert!(needs.irradiance && needs.color_map && needs.occlusion);
    assert!(!needs.lobes && !needs.hilite && !needs.smooth_normal && !needs.rim);
}

#[test]
fn work_decides_where_a_quantity_is_computed() {
    const TEXT: &str = "\
// effect: veil, slow light
//
// gives: veil_part
// adds: veil
// domain: texel, fragment
// sampled: 0.002
// cost: 300
fn veil(irradiance: vec3f) -> vec3f {
    return irradiance * irradiance;
}
";
    let effect = register("veil", TEXT).unwrap().effect;
    let setup = Setup::new(Form::Corrected, Silhouette::Fragment, Effects::of(&[effect]));
    let few = Work { vertices: 1e4, texels: 1e5, fragments: 2e6 };
    let planned = |work, budget| {
        let planned = plan(&Facts { setup, work, budget, atlas: Some(512), ..Facts::default() }).unwrap();
        validate(&planned);
        planned.passes.iter().for_each(|pass| validate(&pass.plan));
        planned
    };
    let within = Budget::Within(0.003);
    let texels = planned(few, within);
    assert_eq!((texels.passes.len(), names(&texels.levels)), (1, vec!["veil_part"]));
    assert_eq!(texels.error, 0.002);
    for (work, budget) in [
        (Work { texels: 4e6, ..few }, within),
        (few, Budget::Exact),
        (few, Budget::Paper),
        (few, Budget::Within(0.001)),
    ] {
        let fragments = planned(work, budget);
        assert!(fragments.passes.is_empty() && fragments.levels.is_empty(), "{work:?} {budget:?}");
        assert!(fragments.cost > texels.cost);
    }
}

#[test]
fn what_texels_cannot_have_is_told_with_its_line_and_a_remedy() {
    term();
    let text = MIST.replace("mist", "haar");
    for (old, new, at, problem) in [
        (
            "albedo: vec3f, irradiance",
            "view: vec3f, irradiance",
            "fn haar_light_map",
            "view is not there for texels",
        ),
        ("sampled: 0\n// cost: 4", "cost: 4", "fn haar(", "haar_far is there for texels alone"),
        ("domain: texel\n// cost: 3", "domain: vertex\n// cost: 3", "domain: vertex", "cannot be read"),
        ("vec3f, 7 taps", "vec3f, 6 taps", "6 taps", "cannot be read"),
        (
            "haar_light: vec3f, 7",
            "haar_light: vec2f, 7",
            "fn haar_near_kernel",
            "the type vec2f here, but it is vec3f",
        ),
        ("haar_far_kernel(tap: f32)", "haar_far_kernel()", "fn haar_far_kernel", "is not its kernel"),
        ("(tap: f32)", "(tap: f32, haar_lit: vec3f)", "fn haar_far_kernel", "is not its kernel"),
        (
            "domain: texel\n// pass: haar_lit",
            "pass: haar_lit",
            "fn haar_far_kernel",
            "`pass:` belongs to a rule of",
        ),
        (
            "// adds: haar",
            "// adds: haar\n// sampled: 0",
            "fn haar(",
            "`sampled:` belongs to a rule of texels",
        ),
        ("domain: texel\n// cost: 20", "cost: 20", "fn haar_stretch_map", "rasterised fragments alone"),
    ] {
        assert!(text.contains(old), "{old}");
        let changed = text.replacen(old, new, 1);
        let line = changed.lines().position(|line| line.contains(at)).unwrap() + 1;
        let error = register("haar", &changed).map(|term| term.effect).unwrap_err();
        assert!(error.line == line && error.to_string().contains(problem), "{new}: {error}");
    }
    for (old, new, at) in [
        ("gives: haar_light", "gives: haar_level", "fn haar_light_map"),
        ("gives: haar_lit", "gives: haar_near_along_u", "fn haar_lit_again"),
        ("gives: haar_lit", "gives: d_haar_near", "fn haar_lit_again"),
        ("parameter: haar_weight", "parameter: d_haar_weight", "parameter: d_haar_weight"),
        ("fn haar_light_map", "fn sample_level", "fn sample_level"),
        ("fn haar_light_map", "fn vs_main", "fn vs_main"),
        ("fn haar_lit_again", "fn fs_main", "fn fs_main"),
    ] {
        let changed = text.replacen(old, new, 1);
        let line = changed.lines().position(|line| line.contains(at)).unwrap() + 1;
        let error = register("haar", &changed).map(|term| term.effect).unwrap_err();
        assert!(error.line == line && matches!(error.problem, Problem::Reserved(_)), "{new}: {error}");
    }
    let held = text
        .replacen("(vertex_position: vec3f) -> vec2f", "(vertex_position: vec3f) -> vec4f", 1)
        .replacen("sqrt(vec2f(dot(along, along), dot(down, down)))", "sqrt(vec4f(dot(along, along)))", 1)
        .replacen("haar_stretch: vec2f) ->", "haar_stretch: vec4f) ->", 1)
        .replacen("dot(haar_stretch, axis)", "dot(haar_stretch.xy, axis)", 1);
    let error = register("haar", &held).unwrap_err();
    assert!(matches!(error.problem, Problem::NoLevel { .. }), "{error}");
}

#[test]
fn what_one_fetch_looks_up_is_filled_by_passes_of_its_own() {
    let mut facts = facts(Effects::of(&[Effect::Occlusion]));
    facts.setup.choices.diffusion.lookup = Lookup::Dilated;
    let plan = plan(&facts).unwrap();
    validate(&plan);
    let last: Vec<(PassKind, Vec<&str>, Vec<&str>)> = plan.passes[6..]
        .iter()
        .map(|pass| (pass.kind, names(&pass.plan.levels), names(&pass.leaves)))
        .collect();
    let filled = |from, to| (PassKind::Dilate, vec![from], vec![to]);
    assert_eq!(last, [filled("mist_near", "mist_near_dilated"), filled("mist_far", "mist_far_dilated")]);
    plan.passes.iter().for_each(|pass| validate(&pass.plan));
    assert_eq!(names(&plan.levels), ["mist_near_dilated", "mist_far_dilated"]);
    assert!(plan.wgsl.contains("let mist_far: vec3f = level_at(mist_far_dilated_level, at.vertex_uv).xyz;"));
    let along = Along::new(&plan, &Seed::of_param(Param::Occlusion)).unwrap();
    along.passes.iter().for_each(|pass| validate(&pass.plan));
    let [.., last] = along.passes.as_slice() else { panic!("nothing moves") };
    assert_eq!(
        (names(&last.plan.levels), names(&last.leaves)),
        (vec!["d_mist_far"], vec!["d_mist_far_dilated"])
    );
    // Of stored samples the processor fills what it finds empty.
    let stored = crate::shader::plan(&Facts { source: Source::Samples, ..facts }).unwrap();
    assert_eq!((stored.passes.len(), names(&stored.levels)), (6, vec!["mist_near", "mist_far"]));
}

#[test]
fn adapters_refuse_what_the_processor_alone_does() {
    library::register_all();
    let diffusion = Effect::from_name("diffusion").unwrap();
    let mut facts = facts(Effects::of(&[diffusion, Effect::Diffuse]));
    assert!(plan(&facts).is_ok());
    let refused = |facts: &Facts| plan(facts).unwrap_err();
    facts.setup.choices.diffusion.seams = Seams::Joined;
    let joined = refused(&facts);
    assert!(matches!(joined, PlanError::Joined { .. }) && joined.to_string().contains("seams = \"cut\""));
    assert!(plan(&Facts { source: Source::Samples, ..facts }).is_ok());
    facts.setup.choices.diffusion = DiffusionChoices { method: Method::Surface, ..DiffusionChoices::DEFAULT };
    let over = refused(&facts);
    assert_eq!(over, PlanError::OverSurface { level: "diffusion_level_1" });
    assert!(over.to_string().contains("method = \"separable\""));
    let stored = plan(&Facts { source: Source::Samples, ..facts }).unwrap();
    let sums: Vec<&Pass> = stored.passes.iter().filter(|pass| pass.kind == PassKind::Surface).collect();
    assert_eq!(sums.len(), 3);
    for pass in sums {
        validate(&pass.plan);
        let read = ["diffusion_level_0", "diffusion_place", "diffusion_facing", "diffusion_area"];
        assert_eq!(names(&pass.plan.levels), read);
    }
}
