//! The shader planner: every plan is a valid module, the cheapest one, and asks for no more than its effects.

use std::collections::BTreeSet;

use naga::valid::{Capabilities, ValidationFlags, Validator};
use rayon::prelude::*;
use skinfit::model::dapple::Dapple;
use skinfit::model::effects::{Effect, Effects, Form, Lookups, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::terms::TermName;
use skinfit::model::texture_filter::TextureFilter;
use skinfit::shader::domain::Work;
use skinfit::shader::facts::{FaceSizes, MapFacts};
use skinfit::shader::visibility_buffer::VisibilityBuffer;
use skinfit::shader::{Budget, Facts, Plan, Resource, Source, plan};

/// The effects that the fragment stage knows; morphs and bones are facts of their own.
const FRAGMENT_EFFECTS: [Effect; 10] = [
    Effect::Diffuse,
    Effect::NormalMap,
    Effect::Occlusion,
    Effect::Rim,
    Effect::SideSpecular,
    Effect::Hilite,
    Effect::Reflection,
    Effect::Haze,
    Effect::Bloom,
    Effect::KeyLight,
];

fn effect_sets() -> impl Iterator<Item = Effects> {
    (0..1_u32 << FRAGMENT_EFFECTS.len()).map(|bits| {
        FRAGMENT_EFFECTS
            .into_iter()
            .enumerate()
            .filter(|(i, _)| bits & (1 << i) != 0)
            .map(|(_, e)| e)
            .collect()
    })
}

/// Every effect set, form and silhouette; of every seventh the paper's other readings too, so that each form and
/// silhouette, which come in sixes, meets them with other effects.
fn setups() -> Vec<Setup> {
    let mut all: Vec<Setup> = first_versions().collect();
    let other = |setup: &Setup| Setup {
        lookups: Lookups::Smooth,
        dapple: Dapple::new([0.48, -0.36, 0.8], 30.0, true),
        interpolated_rim: true,
        ..*setup
    };
    let others: Vec<Setup> = all.iter().step_by(7).map(other).collect();
    all.extend(others);
    all
}

fn first_versions() -> impl Iterator<Item = Setup> {
    effect_sets().flat_map(|effects| {
        Form::ALL.into_iter().flat_map(move |form| {
            Silhouette::ALL.into_iter().map(move |silhouette| Setup::new(form, silhouette, effects))
        })
    })
}

fn must_plan(facts: &Facts) -> Plan {
    plan(facts).unwrap_or_else(|error| panic!("{facts:?}: {error}"))
}

fn complain(plan: &Plan, error: &str) -> ! {
    panic!("{:?}\n{error}\n{}", plan.facts, plan.wgsl)
}

/// Panics with the module's text where naga finds fault with it.
fn validate(plan: &Plan) {
    validate_text(plan, &plan.wgsl);
}

fn validate_text(plan: &Plan, wgsl: &str) {
    let module = naga::front::wgsl::parse_str(wgsl)
        .unwrap_or_else(|error| complain(plan, &error.emit_to_string(wgsl)));
    let capabilities = if plan.uses_f16() { Capabilities::SHADER_FLOAT16 } else { Capabilities::empty() };
    Validator::new(ValidationFlags::all(), capabilities)
        .validate(&module)
        .unwrap_or_else(|error| complain(plan, &error.emit_to_string(wgsl)));
}

/// The modules of compute shaders, which the rules that are here all have.
fn validate_visibility_buffer(plan: &Plan) {
    let VisibilityBuffer { vertices, triangles, shading, .. } =
        plan.visibility_buffer("rgba16float").unwrap();
    [vertices, triangles, shading].iter().for_each(|wgsl| validate_text(plan, wgsl));
}

/// Ways in which a scene may differ beside its setup.
fn variants() -> Vec<Facts> {
    let exact = Facts::default();
    let paper = Facts { budget: Budget::Paper, ..exact };
    let no_maps = MapFacts::default();
    vec![
        exact,
        paper,
        Facts { source: Source::Samples, ..exact },
        Facts { maps: no_maps, turned: true, ..exact },
        Facts { morphs: 3, bones: true, square_rim: true, ..exact },
        Facts {
            maps: MapFacts { color_specular: false, normal_attenuator: false, ..exact.maps },
            bones: true,
            ..exact
        },
        Facts { f16: true, morphs: 1, turned: true, ..paper },
        Facts { source: Source::Samples, turned: true, square_rim: true, ..paper },
        Facts { source: Source::Terms, ..exact },
    ]
}

#[test]
fn shaders_of_every_effect_set_form_and_silhouette_validate_in_every_kind_of_scene() {
    let variants = variants();
    let plans: Vec<Plan> = setups()
        .into_par_iter()
        .flat_map_iter(|setup| {
            variants.iter().map(move |facts| must_plan(&Facts { setup, ..*facts })).collect::<Vec<_>>()
        })
        .collect();
    let mut seen = BTreeSet::new();
    let distinct: Vec<&Plan> = plans.iter().filter(|plan| seen.insert(plan.wgsl.as_str())).collect();
    distinct.par_iter().for_each(|plan| validate(plan));
    // Fewer would mean that effects no longer specialise the shader.
    assert!(distinct.len() > 1000, "{} of {}", distinct.len(), plans.len());
}

/// What a fit of everything that an effect set asks for compiles, over samples and over their terms.
#[test]
fn fused_passes_of_every_effect_set_form_and_silhouette_validate() {
    use skinfit::engine::PassOutputs;
    use skinfit::engine::Unknown;
    use skinfit::engine::gpu::fused::{Fitted, Fused, Layout, gather_module, terms_module};
    use skinfit::model::params::{Channels, Column, Param};
    use skinfit::samples::SurfaceRecords;
    use skinfit::samples::surface_records::{Asked, Places};
    use skinfit::scene::Loss;
    let places = Places { base: Some(0), view: Some(3), ..Places::default() };
    let asked = Asked { dapple_normal: true, corners: true, ..Asked::EVERYTHING };
    let records = SurfaceRecords::new(asked, 0);
    let everything = Layout::of_samples(records.places(), records.rows().stride());
    let check = |wgsl: &str| {
        let module = naga::front::wgsl::parse_str(wgsl)
            .unwrap_or_else(|error| panic!("{}\n{wgsl}", error.emit_to_string(wgsl)));
        let valid = Validator::new(ValidationFlags::all(), Capabilities::default()).validate(&module);
        valid.unwrap_or_else(|error| panic!("{}\n{wgsl}", error.emit_to_string(wgsl)));
    };
    check(&gather_module());
    // Every effect alone, and of all sets every 61st: sets of forms and silhouettes come in sixes.
    let few = |setup: &Setup| setup.effects.iter().count() <= 1;
    let chosen = setups().into_iter().enumerate().filter(|(i, setup)| i % 61 == 0 || few(setup));
    chosen.collect::<Vec<_>>().into_par_iter().for_each(|(i, setup)| {
        let free = |param: Param| param.asked_for(setup.effects);
        let lookups = [
            Param::NormalStrength,
            Param::SpecularLobe,
            Param::EnvironmentRotation,
            Param::KeyAzimuth,
            Param::KeyElevation,
        ];
        let green = free(Param::RimWeight)
            .then_some(Unknown::Param(Column { param: Param::RimWeight, channels: Channels::One(1) }));
        let tied = |&p: &Param| free(p) && p != Param::RimWeight;
        let all: Vec<Unknown> = Param::built_in()
            .filter(tied)
            .map(|p| Unknown::Param(Column::tied(p)))
            .chain(green)
            .chain([Unknown::Gain(1, Channels::Tied)])
            // Of some, a view's white balance too.
            .chain((i % 3 == 0).then_some(Unknown::Gain(2, Channels::One(2))))
            .collect();
        let held = |u: &Unknown| !matches!(u, Unknown::Param(c) if lookups.contains(&c.param));
        let kept: Vec<Unknown> = all.iter().copied().filter(held).collect();
        // Records shorter than their terms, and longer ones, with shares.
        let samples = if i % 2 == 0 { Layout::of_samples(&places, 6) } else { everything.clone() };
        let sizes = FaceSizes { irradiance: Some(16), specular: Some(32), hilite: Some(8), reflected: None };
        let fitted = |unknowns: Vec<Unknown>, layout: &Layout, bits: usize| Fitted {
            setup,
            output: None,
            unknowns,
            loss: Loss::RelativeL2,
            alpha: bits & 1 == 0,
            turned: true,
            layout: layout.clone(),
            several: bits & 2 != 0,
            weighted: bits & 4 != 0,
            clipped: bits & 8 != 0,
            gained: bits & 16 != 0,
            faces: if bits & 32 != 0 { sizes } else { FaceSizes::default() },
        };
        let terms = Layout::of_terms(setup, &samples);
        check(&terms_module(&fitted(Vec::new(), &samples, 0), &terms).unwrap().1);
        // None, all but one, and one alone, in turn.
        let bits = [0, 63 ^ 1 << (i / 61 % 6), 1 << (i / 61 % 6)];
        for (unknowns, layout, bits) in
            [(all, &samples), (kept, &terms)].into_iter().flat_map(|(u, l)| bits.map(|b| (u.clone(), l, b)))
        {
            let fused = Fused::new(fitted(unknowns, layout, bits)).unwrap();
            fused.slabs(PassOutputs::Normal).iter().for_each(|slab| check(&slab.wgsl));
            check(&fused.image_module());
        }
    });
}

#[test]
fn shaders_of_every_combination_of_facts_validate() {
    let setup = Setup::new(
        Form::Corrected,
        Silhouette::Fragment,
        Effects::SURFACE.with(Effect::Haze).with(Effect::KeyLight),
    );
    let bit = |bits: u32, i: u32| bits & (1 << i) != 0;
    let facts = |bits: u32, budget| Facts {
        setup,
        source: Source::Raster,
        maps: MapFacts {
            color: bit(bits, 0),
            normal: bit(bits, 1),
            specular: bit(bits, 2),
            attenuator: bit(bits, 3),
            color_specular: bit(bits, 0) && bit(bits, 2),
            normal_attenuator: bit(bits, 1) && bit(bits, 3),
            filter: TextureFilter::ALL[bits as usize % 3],
            ..MapFacts::default()
        },
        faces: FaceSizes::default(),
        morphs: if bit(bits, 4) { 2 } else { 0 },
        bones: bit(bits, 5),
        turned: bit(bits, 6),
        square_rim: bit(bits, 7),
        f16: bit(bits, 8),
        tessellation: 0.003,
        atlas: None,
        own_atlas_uvs: false,
        stored_texels: false,
        shadows: None,
        work: Work::default(),
        budget,
        output: None,
    };
    (0..1_u32 << 9).into_par_iter().for_each(|bits| {
        for budget in [Budget::Exact, Budget::Paper, Budget::Within(0.01)] {
            let plan = must_plan(&facts(bits, budget));
            validate(&plan);
            validate_visibility_buffer(&plan);
            validate_visibility_buffer(&plan.fetches_alone());
        }
    });
}

#[test]
fn each_term_alone_validates_and_costs_less_than_the_whole() {
    let effects = Effects::SURFACE.with(Effect::KeyLight);
    let setup = Setup::new(Form::Corrected, Silhouette::Fragment, effects);
    let whole = must_plan(&Facts { setup, ..Facts::default() });
    for term in TermName::BUILT_IN {
        let alone = must_plan(&Facts { setup, output: Some(term), ..Facts::default() });
        validate(&alone);
        assert!(alone.cost < whole.cost, "{}: {} of {}", term.name(), alone.cost, whole.cost);
    }
}

#[test]
fn turning_an_effect_off_never_costs_more() {
    let paper = Facts { budget: Budget::Paper, f16: true, ..Facts::default() };
    setups().into_par_iter().for_each(|setup| {
        for facts in [Facts::default(), paper] {
            let all = must_plan(&Facts { setup, ..facts });
            for effect in setup.effects.iter() {
                let less = Setup { effects: setup.effects.without(effect), ..setup };
                let without = must_plan(&Facts { setup: less, ..facts });
                let counts = |plan: &Plan| {
                    // A step that costs nothing hands a value on under another name.
                    let steps = plan.steps.iter().filter(|step| step.cost > 0.0).count();
                    [steps, plan.resources.len(), plan.attributes.len(), plan.constants.len()]
                };
                let fewer = counts(&without).iter().zip(counts(&all)).all(|(a, b)| *a <= b);
                let saved = without.cost <= all.cost && fewer;
                let steps = |plan: &Plan| plan.steps.iter().map(|step| step.rule.name).collect::<Vec<_>>();
                assert!(
                    saved,
                    "{facts:?}\n{setup:?} without {}: {} {:?} {:?}, with it {} {:?} {:?}",
                    effect.name(),
                    without.cost,
                    counts(&without),
                    steps(&without),
                    all.cost,
                    counts(&all),
                    steps(&all)
                );
            }
        }
    });
}

#[test]
fn exact_plans_bring_no_error_and_budgets_are_kept() {
    let coarse = Facts { tessellation: 0.02, ..Facts::default() };
    assert_eq!(must_plan(&coarse).error, 0.0);
    let mut last = f64::INFINITY;
    for most in [0.0, 0.003, 0.005, 0.01, 0.02, 0.03, 0.1] {
        let plan = must_plan(&Facts { budget: Budget::Within(most), ..coarse });
        assert!(plan.error <= most + 1e-9, "{most}: {}", plan.error);
        assert!(plan.cost <= last, "a larger budget costs more: {most}");
        last = plan.cost;
    }
    let paper = must_plan(&Facts { budget: Budget::Paper, ..coarse });
    assert!(paper.resources.contains(&Resource::SpecularCube) && paper.cost <= last);
}

#[test]
fn the_silhouette_is_interpolated_only_where_the_mesh_is_fine_enough() {
    // Where nothing else asks for V at the fragment; elsewhere there is nothing to save.
    let effects = Effects::of(&[Effect::Diffuse, Effect::Rim]);
    let setup = Setup::new(Form::Corrected, Silhouette::Fragment, effects);
    let chosen = |tessellation: f64| {
        let facts = Facts { setup, tessellation, budget: Budget::Within(1e-3), ..Facts::default() };
        must_plan(&facts).steps.iter().any(|step| step.rule.name == "silhouette_approximated")
    };
    assert!(chosen(5e-4) && !chosen(2e-3));
}

#[test]
fn maps_of_one_size_are_packed_when_both_are_asked_for() {
    let with = |effects: &[Effect]| {
        let setup = Setup::new(Form::Corrected, Silhouette::Fragment, Effects::of(effects));
        must_plan(&Facts { setup, ..Facts::default() }).resources
    };
    assert!(with(&[Effect::Diffuse, Effect::SideSpecular]).contains(&Resource::ColorSpecularTexels));
    assert!(with(&[Effect::Diffuse]).contains(&Resource::ColorTexels));
    assert!(with(&[Effect::SideSpecular]).contains(&Resource::SpecularTexels));
}

#[test]
fn maps_are_filtered_over_fragments_only_where_that_is_asked_for() {
    let facts = |filter, budget| {
        let default = Facts::default();
        Facts { maps: MapFacts { filter, ..default.maps }, budget, ..default }
    };
    for budget in [Budget::Exact, Budget::Paper] {
        let [bilinear, trilinear, anisotropic] =
            TextureFilter::ALL.map(|filter| plan(&facts(filter, budget)).unwrap());
        for word in ["dpdx", "textureSample(", "sample_mip", "textureNumLevels"] {
            assert!(!bilinear.wgsl.contains(word), "{word}");
        }
        let exact = budget == Budget::Exact;
        for filtered in [&trilinear, &anisotropic] {
            assert!(filtered.wgsl.contains(if exact { "sample_mip_texels(" } else { "textureSample(" }));
            assert!(
                !filtered.wgsl.contains("sample_texels(")
                    && !filtered.wgsl.contains("map_sampler, vertex_uv, 0.0")
            );
            // What is fetched alone is fetched in the same way.
            for plan in [filtered, &filtered.fetches_alone()] {
                let module = naga::front::wgsl::parse_str(&plan.wgsl).unwrap();
                let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
                validator.validate(&module).unwrap_or_else(|error| panic!("{error:?}\n{}", plan.wgsl));
            }
        }
        // The sampler says how many places there are; in the shader it is a number.
        assert_eq!(trilinear.wgsl == anisotropic.wgsl, !exact);
    }
}
