//! `skinfit tradeoff`: what it measures where the answer is known, and settings that keep their promise.

use serde_json::Value;

use super::sandbox::{Ran, Sandbox};

/// Every axis that the scene asks for, in the order of documentation.
const AXES: [&str; 12] = [
    "format",
    "silhouette",
    "irradiance",
    "specular",
    "hilite",
    "filter",
    "lobes",
    "rays",
    "samples",
    "texture_filter",
    "pixels",
    "solver",
];

/// The settings of an axis in `results.json`.
fn settings(sandbox: &Sandbox, folder: &str, axis: &str) -> Vec<Value> {
    let file = sandbox.json(&format!("{folder}/results.json"));
    let axes = file["axes"].as_array().unwrap();
    let found = axes.iter().find(|sweep| sweep["axis"] == axis).unwrap_or_else(|| panic!("no axis {axis}"));
    found["settings"].as_array().unwrap().clone()
}

fn error(setting: &Value) -> f64 {
    setting["error"]["relative"].as_f64().unwrap()
}

fn named<'a>(settings: &'a [Value], name: &str) -> &'a Value {
    settings.iter().find(|s| s["name"].as_str().unwrap().starts_with(name)).unwrap()
}

/// A tradeoff that was done, and said nothing but how long it would take, and that no light of the sandbox has a shadow.
pub(super) fn done(ran: Ran) -> Ran {
    let said = ran.err.lines().filter(|line| !line.ends_with("shadows: no light has a shadow."));
    assert_eq!((ran.code, said.count()), (Some(0), 1), "{ran:?}");
    assert!(ran.err.starts_with("skinfit: this will take about "), "{ran:?}");
    ran
}

#[test]
fn what_the_scene_has_is_among_the_settings_and_marked() {
    let sandbox = Sandbox::new();
    // Between the swept ones; the greatest of all; and one of them.
    sandbox.edit("occlusion_rays = 32", "occlusion_rays = 48");
    sandbox.edit("irradiance_size = 8", "irradiance_size = 144");
    let axes = ["irradiance", "specular", "rays", "silhouette", "filter"];
    let options = axes.iter().flat_map(|axis| ["--axis", axis]).collect::<Vec<_>>();
    let ran = done(sandbox.run(&[&["tradeoff", "scene.toml", "-o", "cost"][..], &options].concat()));
    let page = sandbox.text("cost/report.html");
    for (axis, name) in [("irradiance", "144"), ("specular", "8"), ("rays", "48"), ("silhouette", "fragment")]
    {
        let settings = settings(&sandbox, "cost", axis);
        let present: Vec<&Value> = settings.iter().filter(|s| s["present"] == true).collect();
        assert_eq!((present.len(), present[0]["name"].as_str()), (1, Some(name)), "{axis}");
        // The greatest is the reference, whoever named it.
        assert_eq!(present[0]["reference"] == true, axis == "irradiance" || axis == "silhouette");
        let marked = format!("{name} (the scene&#39;s)");
        assert!(sandbox.text(&format!("cost/{axis}.svg")).contains(&marked), "{axis}");
        assert!(page.contains(&marked), "{axis}");
    }
    let names: Vec<Value> = settings(&sandbox, "cost", "rays").iter().map(|s| s["name"].clone()).collect();
    assert_eq!(names, ["4", "8", "16", "32", "48", "64", "128", "256", "1024"]);
    assert_eq!(ran.out.matches("the scene's\n").count(), 4, "{ran:?}");
    let line = ran.out.lines().find(|line| line.trim_start().starts_with("144 ")).unwrap();
    assert!(line.ends_with("  pareto, reference, the scene's"), "{line}");
    assert!(page.contains("<td>reference, the scene&#39;s</td>"));
    // No word of a view's stands for a setting that nothing beats.
    let csv = sandbox.text("cost/results.csv");
    let columns: Vec<&str> = csv.lines().next().unwrap().split(',').collect();
    assert!(columns.contains(&"pareto") && columns.contains(&"present") && !columns.contains(&"front"));
    assert!(!ran.out.contains("front") && page.contains(">pareto</th>"), "{ran:?}");
    assert!(settings(&sandbox, "cost", "filter").iter().all(|s| s["present"] == false));
}

#[test]
fn samples_that_are_used_again_give_what_those_traced_anew_do() {
    use skinfit::study::tradeoff::bench::Bench;
    let sandbox = Sandbox::new();
    let path = sandbox.path("scene.toml");
    let bench = Bench::new(&path, None, Some(sandbox.cache())).unwrap();
    let own = bench.settings();
    let mut other = [own; 4];
    other[0].quality.occlusion_rays = 16;
    other[1].quality.samples_per_axis = 2;
    other[2].quality.lobe_size = 16;
    other[3].silhouette = skinfit::model::effects::Silhouette::Vertex;
    for settings in [own].into_iter().chain(other) {
        let (kept, anew) = (bench.evaluate(settings).unwrap(), bench.evaluate_anew(settings).unwrap());
        let (kept, anew) = (kept.images(&bench.point()).unwrap(), anew.images(&bench.point()).unwrap());
        for (kept, anew) in kept.iter().zip(&anew) {
            assert!(kept.rgb == anew.rgb && kept.alpha == anew.alpha, "{settings:?}");
        }
    }
    // What a setting does not touch is not made twice.
    let samples = |settings| bench.evaluate(settings).unwrap().samples;
    assert!(std::sync::Arc::ptr_eq(&samples(own), &samples(other[2])));
    assert!(std::sync::Arc::ptr_eq(&samples(other[1]), &samples(other[1])));
}

#[test]
fn how_long_it_will_take_is_said_before_of_each_axis_and_of_all() {
    let sandbox = Sandbox::new();
    let axes = ["irradiance", "rays", "samples"];
    let options = axes.iter().flat_map(|axis| ["--axis", axis]).collect::<Vec<_>>();
    let ran = done(sandbox.run(&[&["tradeoff", "scene.toml", "-o", "cost"][..], &options].concat()));
    // `this will take about 10 s (irradiance 4 s, rays 5 s, samples 2 s).`
    let seconds = |words: &str| -> f64 {
        let mut words = words.split([' ', ',', ')']).filter(|word| !word.is_empty());
        let number: f64 = words.next().unwrap().parse().unwrap();
        number * if words.next() == Some("min") { 60.0 } else { 1.0 }
    };
    let told = seconds(ran.err.split("about ").nth(1).unwrap());
    let of_axes: f64 =
        axes.map(|axis| seconds(ran.err.split(&format!("{axis} ")).nth(1).unwrap())).iter().sum();
    // Each is rounded by itself. What is foretold from which measurement is the axes' own test: how long the machine
    // then takes is no test's.
    assert!(told > 0.0 && (of_axes - told).abs() <= 0.25 * told + 1.0, "{ran:?}");
}

#[test]
fn every_axis_has_a_reference_without_error_and_settings_that_nothing_beats() {
    let sandbox = Sandbox::new();
    done(sandbox.run(&["tradeoff", "scene.toml", "-o", "cost", "--params", "truth.toml"]));
    for axis in AXES {
        let settings = settings(&sandbox, "cost", axis);
        let references: Vec<&Value> = settings.iter().filter(|s| s["reference"] == true).collect();
        assert_eq!(references.len(), 1, "{axis}");
        assert_eq!(error(references[0]), 0.0, "{axis}");
        let others = settings.iter().filter(|s| s["reference"] == false);
        // A solver or a fit to fewer pixels may find the same answer to the bit.
        assert!(others.clone().any(|s| error(s) > 0.0) || axis == "pixels", "{axis}: {settings:?}");
        assert!(settings.iter().any(|s| s["pareto"] == true), "{axis}");
        // What is Pareto-optimal is not beaten.
        for s in settings.iter().filter(|s| s["pareto"] == true) {
            let cost = |s: &Value| s["cost"].as_f64().unwrap();
            assert!(!settings.iter().any(|o| cost(o) < cost(s) && error(o) < error(s)), "{axis}: {s}");
        }
        assert!(sandbox.text(&format!("cost/{axis}.svg")).starts_with("<svg"));
    }
    let lines = sandbox.text("cost/results.csv").lines().count();
    let all: usize = AXES.iter().map(|axis| settings(&sandbox, "cost", axis).len()).sum();
    assert_eq!(lines, 1 + all);
}

#[test]
fn errors_fall_as_they_must() {
    let sandbox = Sandbox::new();
    let axes = ["--axis", "format", "--axis", "silhouette", "--axis", "filter", "--axis", "rays"];
    done(
        sandbox
            .run(&[&["tradeoff", "scene.toml", "-o", "cost", "--params", "truth.toml"][..], &axes].concat()),
    );
    // Each format has more bits than the one before; binary32 rounds to 6e-8 and is off by some ten roundings.
    let formats = settings(&sandbox, "cost", "format");
    let errors: Vec<f64> =
        ["fixed12", "as listed", "f16", "f32", "f64"].map(|name| error(named(&formats, name))).into();
    assert!(errors.windows(2).all(|pair| pair[0] > pair[1]), "{errors:?}");
    assert!(errors[3] < 2e-6 && errors[2] < 5e-3 && errors[2] > 1e-5, "{errors:?}");
    let filters = settings(&sandbox, "cost", "filter");
    assert!(error(named(&filters, "nearest")) > 10.0 * error(named(&filters, "8-bit")), "{filters:?}");
    // Cutting a mesh finer quarters the sag of its cosines each time, making it coarser four-folds it; the ball's
    // silhouettes leave a wide margin.
    let vertex: Vec<f64> = settings(&sandbox, "cost", "silhouette")
        .iter()
        .filter(|s| s["name"].as_str().unwrap().starts_with("vertex"))
        .map(error)
        .collect();
    assert!(vertex.len() > 3, "{vertex:?}");
    assert!(vertex.windows(2).all(|pair| pair[0] > 1.5 * pair[1]), "{vertex:?}");
    // Sixteen times the rays: the error falls by four for random ones, and more for these.
    let rays = settings(&sandbox, "cost", "rays");
    let exact = |name: &str| error(rays.iter().find(|s| s["name"] == name).unwrap());
    assert!(exact("16") > 3.0 * exact("256"), "{rays:?}");
}

#[test]
fn chosen_settings_keep_their_promise_when_they_are_measured_again() {
    let sandbox = Sandbox::new();
    let run = |to: &str, axes: &[&str], goal: &[&str]| {
        let axes: Vec<&str> = axes.iter().flat_map(|axis| ["--axis", axis]).collect();
        sandbox
            .run(&[&["tradeoff", "scene.toml", "--params", "truth.toml", "-o", to][..], &axes, goal].concat())
    };
    let ran = done(run("near", &["irradiance", "rays"], &["--within", "1%"]));
    assert!(ran.out.contains("within 1.0000%: irradiance"), "{ran:?}");
    let choice = sandbox.json("near/results.json")["choice"].clone();
    assert!(choice["error"]["relative"].as_f64().unwrap() <= 0.01, "{choice}");
    // The scene file has the settings, and is a scene: its image is as near to that of the references.
    let table: toml::Table = sandbox.text("near/scene.toml").parse().unwrap();
    let text = |name: &str| {
        choice["settings"].as_array().unwrap().iter().find(|s| s[0] == name).unwrap()[1]
            .as_str()
            .unwrap()
            .to_owned()
    };
    let quality = |key: &str| table["quality"][key].as_integer().unwrap().to_string();
    assert_eq!(quality("occlusion_rays"), text("rays"));
    assert_eq!(quality("irradiance_size"), text("irradiance"));
    let mut best = table.clone();
    let references = [("irradiance_size", 128), ("occlusion_rays", 1024)];
    for (key, value) in references {
        best["quality"].as_table_mut().unwrap().insert(key.to_owned(), value.into());
    }
    sandbox.write("best.toml", best.to_string().as_bytes());
    let image = |scene: &str, to: &str| {
        sandbox
            .run(&["render", scene, "--engine", "cpu", "--params", "truth.toml", "--view", "front", "-o", to])
            .done();
        crate::fixtures::read_exr(&sandbox.path(to)).rgb(["R", "G", "B"])
    };
    let (near, best) = (image("near/scene.toml", "near.exr"), image("best.toml", "best.exr"));
    let sum = |f: &dyn Fn(usize, usize) -> f32| -> f64 {
        (0..best.len())
            .flat_map(|i| (0..3).map(move |c| (i, c)))
            .map(|(i, c)| f64::from(f(i, c)).powi(2))
            .sum()
    };
    let relative = (sum(&|i, c| near[i][c] - best[i][c]) / sum(&|i, c| best[i][c])).sqrt();
    // One view of two: its share of the error may be the greater one.
    assert!(relative <= 0.015, "{relative}");
    // More is allowed for less; and where nothing is near enough, the sweeps are there all the same.
    let few = ["irradiance", "rays"];
    done(run("far", &few, &["--within", "20%"]));
    // Which is the cheapest is measured, and so are the settings; that they keep within what is allowed is not.
    let far = sandbox.json("far/results.json")["choice"].clone();
    assert!(far["error"]["relative"].as_f64().unwrap() <= 0.2, "{far}");
    assert!(far["settings"].as_array().unwrap().iter().any(|setting| setting[0] == "rays"), "{far}");
    done(run("soon", &few, &["--budget", "60s"]));
    assert_eq!(sandbox.json("soon/results.json")["choice"]["error"]["relative"].as_f64(), Some(0.0));
    let ran = run("soon", &few, &["--budget", "0.000001ms"]);
    assert_eq!(ran.code, Some(1), "{ran:?}");
    assert!(ran.err.contains("soon: no settings are within 1.00×10⁻⁶ ms: the cheapest take "), "{ran:?}");
    assert!(ran.err.contains("(irradiance 4, ") && ran.err.ends_with("). Allow more.\n"), "{ran:?}");
    let results = sandbox.json("soon/results.json");
    assert!(results["choice"].is_null() && results["axes"].as_array().unwrap().len() == 2);
    assert!(results["missed"]["least"].as_str().unwrap().starts_with("the cheapest take"));
    // What the settings of the run before were is no longer true here.
    assert!(!sandbox.path("soon/scene.toml").exists() && sandbox.path("soon/rays.svg").exists());
    for setting in settings(&sandbox, "soon", "rays") {
        let time = |key: &str| setting["time"][key].as_f64().unwrap();
        assert!(time("rounds") >= 3.0, "{setting}");
        assert_eq!(setting["cost"].as_f64(), setting["time"]["least"].as_f64());
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    let sandbox = Sandbox::new();
    let before = sandbox.files();
    let run = |more: &[&str]| sandbox.run(&[&["tradeoff", "scene.toml", "-o", "cost"], more].concat());
    for (more, words) in [
        (&["--axis", "rayz"][..], "Did you mean `rays`?"),
        (&["--within", "0.5"], "such as 0.5%"),
        (&["--within", "-1%"], "such as 0.5%"),
        (&["--within", "NaN%"], "such as 0.5%"),
        (&["--budget", "20"], "such as 20ms"),
        (&["--budget", "0s"], "such as 20ms"),
        (&["--budget", "1s", "--within", "1%"], "cannot be used with"),
    ] {
        let ran = run(more);
        assert_eq!(ran.code, Some(2), "{more:?}: {ran:?}");
        assert!(ran.err.contains(words), "{more:?}: {ran:?}");
    }
    for view in ["front", "side"] {
        sandbox.edit(&format!("target = \"targets/{view}.exr\"\n"), "");
    }
    run(&["--axis", "solver"]).refused(&["the axis solver: no view names a target"]);
    run(&["--axis", "format", "--within", "1%"]).refused(&[
        "an error to stay within: of the axes to be swept (format) none can be set",
        "Sweep some of silhouette, irradiance,",
    ]);
    sandbox.write("scene.toml", &before[&sandbox.path("scene.toml")]);
    assert!(sandbox.files() == before, "something was left");
}

#[test]
fn ways_to_the_skys_light_are_measured_beside_rays() {
    let sandbox = Sandbox::new();
    sandbox
        .edit("\"reflection\"]", "\"reflection\", \"fresnel\", \"directional_occlusion\", \"transmission\"]");
    sandbox.edit("occlusion_rays = 32", "occlusion_rays = 256\nlobe_rays = 32");
    let ways = [
        ("visibility", "rays", "sh4"),
        ("specular_visibility", "rays", "lagarde"),
        ("specular_model", "ggx", "kelemen"),
        ("lobe_lookup", "rays", "mirror"),
        ("skin_reflection", "rays", "gathered"),
        ("bounces", "gathered", "gathered"),
        ("transmission", "gathered", "thickness"),
    ];
    let axes = ways.iter().flat_map(|(axis, ..)| ["--axis", axis]);
    done(sandbox.run(&["tradeoff", "scene.toml", "-o", "cost"].into_iter().chain(axes).collect::<Vec<_>>()));
    for (axis, reference, present) in ways {
        let settings = settings(&sandbox, "cost", axis);
        let of = |key: &str| -> Vec<&str> {
            settings.iter().filter(|s| s[key] == true).map(|s| s["name"].as_str().unwrap()).collect()
        };
        assert_eq!((of("reference"), of("present")), (vec![reference], vec![present]), "{settings:?}");
        assert_eq!(error(named(&settings, reference)), 0.0);
        assert!(settings.iter().all(|s| error(s) < 1.0), "{settings:?}");
    }
    // Little is hidden on a ball with a brow: all ways are near, if they are right.
    let settings = settings(&sandbox, "cost", "visibility");
    assert!(settings.iter().all(|setting| error(setting) < 0.01), "{settings:?}");
    sandbox.write("plain.toml", super::sandbox::SCENE.as_bytes());
    let idle = ["tradeoff", "plain.toml", "-o", "none", "--axis", "visibility"];
    sandbox.run(&idle).refused(&["visibility", "directional_occlusion is off"]);
}

#[test]
fn bumps_below_a_sample_are_measured_beside_many_samples() {
    let sandbox = Sandbox::new();
    sandbox.edit("\"reflection\"]", "\"reflection\", \"lights\", \"light_specular\"]");
    sandbox.edit("file = \"env.exr\"", "file = \"env.exr\"\nlights = 2");
    done(sandbox.run(&["tradeoff", "scene.toml", "-o", "cost", "--axis", "normal_filter"]));
    let settings = settings(&sandbox, "cost", "normal_filter");
    let reference: Vec<&str> =
        settings.iter().filter(|s| s["reference"] == true).map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!((settings.len(), reference), (5, vec!["bilinear, many samples"]));
    let off = |name: &str| error(named(&settings, name));
    assert!(off("bilinear, many samples") == 0.0 && off("trilinear, none") > 0.0, "{settings:?}");
    sandbox.write("plain.toml", super::sandbox::SCENE.as_bytes());
    let idle = ["tradeoff", "plain.toml", "-o", "none", "--axis", "normal_filter"];
    sandbox.run(&idle).refused(&["normal_filter", "light_specular is off"]);
}

#[test]
fn the_most_lights_of_a_panorama_are_what_fewer_are_measured_against() {
    let sandbox = Sandbox::new();
    sandbox.edit("\"reflection\"]", "\"reflection\", \"lights\", \"shadows\"]");
    sandbox.edit("file = \"env.exr\"", "file = \"env.exr\"\nlights = 2");
    done(sandbox.run(&["tradeoff", "scene.toml", "-o", "cost", "--axis", "sky_lights"]));
    let settings = settings(&sandbox, "cost", "sky_lights");
    let names: Vec<&str> = settings.iter().map(|setting| setting["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["0", "1", "2", "4", "8", "16", "32"]);
    let of = |key: &str| -> Vec<&str> {
        settings.iter().filter(|s| s[key] == true).map(|s| s["name"].as_str().unwrap()).collect()
    };
    assert_eq!((of("reference"), of("present")), (vec!["32"], vec!["2"]), "{settings:?}");
    assert_eq!(error(named(&settings, "32")), 0.0);
    // What is taken out has a shadow, so that the image changes.
    assert!(error(named(&settings, "0")) > error(named(&settings, "8")), "{settings:?}");
    sandbox.write("plain.toml", super::sandbox::SCENE.as_bytes());
    let idle = ["tradeoff", "plain.toml", "-o", "none", "--axis", "sky_lights"];
    sandbox.run(&idle).refused(&["sky_lights", "no light is taken out of a panorama"]);
}

#[test]
fn diffusion_is_measured_against_light_by_distance_over_the_surface() {
    let sandbox = Sandbox::new();
    let idle = ["tradeoff", "scene.toml", "-o", "none", "--axis", "taps"];
    sandbox.run(&idle).refused(&["taps", "the effect diffusion is off"]);
    sandbox.edit("\"diffuse\", ", "\"diffuse\", \"diffusion\", ");
    // A ball as wide as a fist in few texels: the widest blur is of some of them.
    sandbox.edit("[mesh]\n", "[mesh]\nmetres_per_unit = 0.05\n");
    sandbox.edit("[quality]", "[diffusion]\nlight_map_size = 64\n[quality]");
    let axes: [(&str, &[&str], &str); 5] = [
        ("taps", &["5", "7", "9", "full", "surface"], "5"),
        ("seams", &["cut", "joined", "surface"], "cut"),
        ("stretch", &["derivative", "exact", "surface"], "exact"),
        ("levels", &["3", "5", "surface"], "3"),
        ("combined", &["pixel", "map", "surface"], "pixel"),
    ];
    let options = axes.iter().flat_map(|(axis, ..)| ["--axis", axis]).collect::<Vec<_>>();
    done(sandbox.run(&[&["tradeoff", "scene.toml", "-o", "cost"][..], &options].concat()));
    for (axis, names, own) in axes {
        let settings = settings(&sandbox, "cost", axis);
        let found: Vec<&str> = settings.iter().map(|setting| setting["name"].as_str().unwrap()).collect();
        assert_eq!(found, names, "{axis}");
        let [others @ .., surface] = &settings[..] else { panic!("{axis}") };
        assert!(surface["reference"] == true && error(surface) == 0.0);
        // Near the reference and not on it: a tenth would be another picture.
        assert!(others.iter().all(|setting| (1e-6..0.1).contains(&error(setting))), "{axis}: {others:?}");
        let present: Vec<&str> = settings
            .iter()
            .filter(|setting| setting["present"] == true)
            .map(|setting| setting["name"].as_str().unwrap())
            .collect();
        assert_eq!(present, [own], "{axis}");
    }
}
