//! Lights in scene files and mesh files: what is read, and what is refused with which words.

use glam::DVec3;
use serde_json::{Value, json};
use skinfit::scene::light::{Beam, Cone, Lamp};
use skinfit::scene::maps::Spots;
use skinfit::scene::{Light, LightKind, Scene, Warning};

use crate::scene_folder::{SCENE, SceneFolder, tampered};

const KEY: &str = "[[light]]
name = \"key\"
type = \"directional\"
direction = [0, -2, 0]
irradiance = [3, 2.5, 2]
angular_diameter_degrees = 0.5
";
const WARM: &str = "[[light]]
name = \"warm_2\"
type = \"spot\"
position = [1, 2, 3]
direction = [0, 0, -3]
intensity = 4
radius = 0.1
range = 20
inner_degrees = 9
outer_degrees = 13
";
const BULB: &str = "[[light]]
name = \"bulb\"
type = \"point\"
position = [1, 2, 3]
intensity = [4, 5, 6]
";

/// The scene with these tables before its views.
fn with(tables: &str) -> Result<Vec<Light>, String> {
    let folder = SceneFolder::new();
    let loaded = folder.edited("[[view]]", &format!("{tables}[[view]]"));
    loaded.map(|(scene, _)| scene.lights).map_err(|error| error.to_string())
}

#[test]
fn lights_of_a_scene_file_are_read_as_they_stand() {
    let lights = with(&format!("{KEY}{WARM}{BULB}")).unwrap();
    let names: Vec<&str> = lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(names, ["key", "warm_2", "bulb"]);
    let beam = Beam { direction: DVec3::NEG_Y, irradiance: [3.0, 2.5, 2.0], angular_diameter_degrees: 0.5 };
    assert_eq!(lights[0].kind, LightKind::Directional(beam));
    let lamp =
        Lamp { position: DVec3::new(1.0, 2.0, 3.0), intensity: [4.0; 3], range: Some(20.0), radius: 0.1 };
    let cone = Cone { direction: DVec3::NEG_Z, inner_degrees: 9.0, outer_degrees: 13.0 };
    assert_eq!(lights[1].kind, LightKind::Spot(lamp.clone(), cone));
    let bulb = Lamp { intensity: [4.0, 5.0, 6.0], range: None, radius: 0.0, ..lamp };
    assert_eq!(lights[2].kind, LightKind::Point(bulb));
    assert!(with("").unwrap().is_empty());
    // A cone that is not given is glTF's.
    let open = with(&WARM.replace("inner_degrees = 9\nouter_degrees = 13\n", "")).unwrap();
    assert!(
        matches!(&open[0].kind, LightKind::Spot(_, cone) if (cone.inner_degrees, cone.outer_degrees) == (0.0, 45.0))
    );
}

#[test]
fn spots_of_the_panorama_are_read() {
    let folder = SceneFolder::new();
    let spots = |keys: &str| {
        let (scene, _) = folder.edited("\"env.exr\"", &format!("\"env.exr\"\n{keys}")).unwrap();
        scene.environment.unwrap().spots
    };
    assert_eq!(spots(""), Spots { count: 0, degrees: 4.0 });
    assert_eq!(spots("lights = 4\nlight_spot_degrees = 2.5"), Spots { count: 4, degrees: 2.5 });
}

#[test]
fn refusals_of_lights_say_where_what_and_what_to_do() {
    // The tables begin at line 14.
    let line = 1 + SCENE[..SCENE.find("[[view]]").unwrap()].matches('\n').count();
    let cases: [(&str, &str, &str, usize, &[&str]); 32] = [
        (KEY, "directional", "sun", 2, &["unknown type of light `sun`", "directional, point, spot"]),
        (KEY, "directional", "direktional", 2, &["Did you mean `directional`"]),
        (KEY, "type = \"directional\"\n", "", 0, &["the key `type` is missing", "Add `type`"]),
        (KEY, "name = \"key\"\n", "", 0, &["`name`", "missing"]),
        (
            KEY,
            "direction = [0, -2, 0]\n",
            "",
            1,
            &["directional light `key` lacks `direction`", "Add direction"],
        ),
        (KEY, "irradiance = [3, 2.5, 2]\n", "", 1, &["lacks `irradiance`", "needs direction, irradiance"]),
        (KEY, "irradiance", "intensity", 1, &["lacks `irradiance`"]),
        (
            KEY,
            "angular_diameter_degrees",
            "radius",
            5,
            &["a directional light has no `radius`", "Take the key out"],
        ),
        (KEY, "[0, -2, 0]", "[0, 0, 0]", 3, &["direction = [0, 0, 0] points nowhere", "not all 0"]),
        (KEY, "[0, -2, 0]", "[0, nan, 0]", 3, &["direction = [0, NaN, 0] points nowhere"]),
        (KEY, "[0, -2, 0]", "[0, -2]", 3, &["invalid length 2"]),
        (KEY, "[3, 2.5, 2]", "[3, -2.5, 2]", 4, &["irradiance holds -2.5", "[0, 1000000000]"]),
        (KEY, "[3, 2.5, 2]", "[3, 2.5, inf]", 4, &["irradiance holds inf"]),
        (KEY, "[3, 2.5, 2]", "\"white\"", 4, &["a number or [r, g, b]"]),
        (KEY, "0.5", "91", 5, &["angular_diameter_degrees = 91", "[0, 90]"]),
        (KEY, "0.5", "nan", 5, &["angular_diameter_degrees = NaN"]),
        (
            KEY,
            "\"key\"",
            "\"key light\"",
            1,
            &["\"key light\" cannot be part of a parameter's name", "digits and single `_`"],
        ),
        (KEY, "\"key\"", "\"1st\"", 1, &["\"1st\"", "beginning with a letter"]),
        (KEY, "\"key\"", "\"\"", 1, &["cannot be part"]),
        (KEY, "\"key\"", "\"Sky_1\"", 1, &["`Sky_1` is that of a light from the panorama", "another one"]),
        (KEY, "irradiance", "iradiance", 4, &["unknown key `iradiance`", "Did you mean `irradiance`"]),
        (
            WARM,
            "radius = 0.1",
            "angular_diameter_degrees = 0.1",
            6,
            &["a spot light has no `angular_diameter_degrees`"],
        ),
        (
            WARM,
            "position = [1, 2, 3]\n",
            "",
            1,
            &["spot light `warm_2` lacks `position`", "position, direction, intensity"],
        ),
        (WARM, "[1, 2, 3]", "[1, 2, 1e300]", 3, &["position = 1e300", "[-1000000000, 1000000000]"]),
        (WARM, "radius = 0.1", "radius = -0.1", 6, &["radius = -0.1"]),
        (WARM, "range = 20", "range = 0", 7, &["range = 0", "above 0"]),
        (
            WARM,
            "inner_degrees = 9",
            "inner_degrees = 14",
            8,
            &["inner_degrees = 14", "outer_degrees, which is 13"],
        ),
        (WARM, "outer_degrees = 13", "outer_degrees = 100", 9, &["outer_degrees = 100", "up to 90"]),
        (WARM, "intensity = 4", "intensity = -4", 5, &["intensity holds -4"]),
        (
            BULB,
            "intensity",
            "irradiance",
            4,
            &["a point light has no `irradiance`", "position, intensity, range, radius"],
        ),
        (BULB, "intensity = [4, 5, 6]", "inner_degrees = 3", 1, &["lacks `intensity`"]),
        (
            BULB,
            "name = \"bulb\"",
            "name = \"bulb\"\ndirection = [0, 1, 0]",
            2,
            &["a point light has no `direction`"],
        ),
    ];
    let mut failures = String::new();
    for (table, from, to, below, words) in cases {
        assert!(table.contains(from), "{from}");
        let error = with(&table.replacen(from, to, 1)).unwrap_err();
        let place = format!("line {}", line + below);
        for word in words.iter().chain([&place.as_str(), &"scene.toml"]) {
            if !error.contains(word) {
                failures += &format!("{from:?} -> {to:?}: {word:?} is not in {error:?}\n");
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
    let twice = with(&format!("{KEY}{}", BULB.replace("bulb", "KEY"))).unwrap_err();
    assert!(
        twice.contains(&format!("line {}", line + 7)) && twice.contains("two lights are named `KEY`"),
        "{twice}"
    );
}

/// The scene with its mesh file's lights, of which the quad's JSON is changed.
fn of_mesh(tables: &str, change: impl Fn(&mut Value)) -> Result<(Scene, Vec<Warning>), String> {
    let folder = SceneFolder::new();
    folder.write("quad.glb", &tampered(|json, _| change(json)));
    let text = SCENE.replacen("\"quad.glb\"", "\"quad.glb\"\nlights = true", 1);
    folder.write("scene.toml", text.replacen("[[view]]", &format!("{tables}[[view]]"), 1).as_bytes());
    folder.load().map_err(|error| error.to_string())
}

/// Three lights: at a node that is turned and moved below another, at one that is not named, and beside the scene.
fn punctual(json: &mut Value) {
    json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    json["extensions"]["KHR_lights_punctual"]["lights"] = json!([
        {"type": "directional", "color": [1.0, 0.5, 0.25], "intensity": 4.0, "name": "sun"},
        {"type": "spot", "spot": {"innerConeAngle": 0.25, "outerConeAngle": 0.5}, "range": 7.0},
        {"type": "point", "name": "bulb"},
    ]);
    let at = |light: u32| json!({"KHR_lights_punctual": {"light": light}});
    let half = std::f64::consts::FRAC_1_SQRT_2;
    json["nodes"] = json!([
        {"mesh": 0},
        // A quarter turn about +X, from -Z to +Y.
        {"name": "rig", "translation": [0, 1, 0], "rotation": [half, 0, 0, half], "scale": [2, 2, 2], "children": [2, 3]},
        {"name": "Key.001", "translation": [0, 0, -1], "extensions": at(0)},
        {"translation": [0, 0, -1], "extensions": at(1)},
        {"name": "key_001", "translation": [3, 4, 5], "extensions": at(2)},
        {"name": "elsewhere", "extensions": at(2)},
    ]);
    json["scenes"][0]["nodes"] = json!([0, 1, 4]);
}

#[test]
fn lights_of_the_mesh_file_stand_where_their_nodes_do() {
    let (scene, warnings) = of_mesh(BULB, punctual).unwrap();
    let names: Vec<&str> = scene.lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(names, ["bulb", "Key_001", "light_1", "key_001_2"]);
    let near = |a: DVec3, b: DVec3| (a - b).length() < 1e-6; // the quaternion's f32
    let [_, key, spot, point] = &scene.lights[..] else { panic!("{names:?}") };
    let LightKind::Directional(beam) = &key.kind else { panic!("{key:?}") };
    assert!(near(beam.direction, DVec3::Y) && beam.irradiance == [4.0, 2.0, 1.0], "{beam:?}");
    let LightKind::Spot(lamp, cone) = &spot.kind else { panic!("{spot:?}") };
    // A unit along the rig's -Z, which points up and is scaled by 2.
    assert!(near(lamp.position, DVec3::new(0.0, 3.0, 0.0)) && near(cone.direction, DVec3::Y), "{spot:?}");
    assert_eq!((lamp.intensity, lamp.range), ([1.0; 3], Some(7.0)));
    assert_eq!((cone.inner_degrees, cone.outer_degrees), (0.25_f64.to_degrees(), 0.5_f64.to_degrees()));
    let LightKind::Point(lamp) = &point.kind else { panic!("{point:?}") };
    assert_eq!((lamp.position, lamp.radius), (DVec3::new(3.0, 4.0, 5.0), 0.0));
    let said: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    assert!(said.len() == 3 && said[2].contains("the effect `lights` is off"), "{said:?}");
    assert!(said[0].contains("\"Key.001\", is called `Key_001`"), "{said:?}");
    assert!(said[1].contains("`key_001_2`"), "{said:?}");
    // Nobody asked for them.
    let folder = SceneFolder::new();
    folder.write("quad.glb", &tampered(|json, _| punctual(json)));
    assert!(folder.load().unwrap().0.lights.is_empty());
}

#[test]
fn lights_of_a_mesh_file_that_make_no_sense_are_refused_and_missing_ones_are_told() {
    let (scene, warnings) = of_mesh("", |_| ()).unwrap();
    assert!(scene.lights.is_empty() && warnings[0].to_string().contains("has no lights"), "{warnings:?}");
    let cases: [(&str, Value, &str, &[&str]); 7] = [
        (
            "/extensions/KHR_lights_punctual/lights/0/type",
            json!("area"),
            "light 0, node 2",
            &["unknown type `area`", "point"],
        ),
        (
            "/extensions/KHR_lights_punctual/lights/0/intensity",
            json!(-4.0),
            "light 0, node 2",
            &["irradiance holds -4"],
        ),
        (
            "/extensions/KHR_lights_punctual/lights/0/color",
            json!([1]),
            "KHR_lights_punctual",
            &["invalid length 1"],
        ),
        ("/extensions/KHR_lights_punctual/lights/1/range", json!(-1), "light 1, node 3", &["range = -1"]),
        (
            "/extensions/KHR_lights_punctual/lights/1/spot/outerConeAngle",
            json!(0.125),
            "node 3",
            &["inner_degrees"],
        ),
        ("/nodes/2/extensions/KHR_lights_punctual/light", json!(9), "node 2", &["light 9, but there are 3"]),
        ("/nodes/1/scale", json!([0, 0, 0]), "light 0, node 2", &["points nowhere"]),
    ];
    for (place, value, at, words) in cases {
        let error = of_mesh("", |json| {
            punctual(json);
            *json.pointer_mut(place).unwrap() = value.clone();
        })
        .unwrap_err();
        for word in words.iter().chain([&at, &"quad.glb"]) {
            assert!(error.contains(word), "{place}: {word:?} is not in {error:?}");
        }
    }
}

#[test]
fn lights_whose_names_would_mean_each_others_quantities_are_refused() {
    let folder = SceneFolder::new();
    let light = |name: &str| {
        format!(
            "[[light]]\nname = \"{name}\"\ntype = \"directional\"\ndirection = [0, -1, 0]\nirradiance = [1, 1, 1]\n"
        )
    };
    let text = format!("{SCENE}{}{}", light("glow"), light("glow_specular"));
    folder.write("scene.toml", text.as_bytes());
    let error = folder.load().unwrap_err().to_string();
    assert!(error.contains("is there already") && error.contains("Give the light"), "{error}");
}
