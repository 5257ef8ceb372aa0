//! `cameras = true` in a scene file: a fit that first moves cameras to where the targets show the mesh.

use glam::DMat4;

use super::sandbox::Sandbox;

/// A row-major matrix of a view of a scene file.
fn camera(scene: &str, view: usize) -> (DMat4, f64) {
    let scene: toml::Table = scene.parse().unwrap();
    let view = scene["view"][view].as_table().unwrap();
    let number = |x: &toml::Value| x.as_float().or(x.as_integer().map(|x| x as f64)).unwrap();
    let rows: Vec<f64> = view["world_to_camera"].as_array().unwrap().iter().map(number).collect();
    (DMat4::from_cols_slice(&rows).transpose(), number(&view["fov_y_degrees"]))
}

#[test]
fn a_fit_finds_a_displaced_camera_and_writes_it_down() {
    let sandbox = Sandbox::with_shared_bakes();
    sandbox.run(&["demo", "head"]).done();
    let scene = sandbox.text("head/scene.toml");
    let (truth, fov) = camera(&scene, 0);
    // Some five pixels aside, and a field of view that is one and a half percent off.
    let mut aside: toml::Table = scene.parse().unwrap();
    let moved = DMat4::from_translation(glam::DVec3::new(0.015, -0.01, 0.0)) * truth;
    let view = aside["view"].as_array_mut().unwrap()[0].as_table_mut().unwrap();
    let rows = moved.transpose().to_cols_array().map(toml::Value::Float);
    view.insert("world_to_camera".to_owned(), toml::Value::Array(rows.to_vec()));
    view.insert("fov_y_degrees".to_owned(), toml::Value::Float(1.015 * fov));
    // One view is enough, and the others take as long.
    aside["view"].as_array_mut().unwrap().truncate(1);
    let fit = aside["fit"].as_table_mut().unwrap();
    fit.insert("cameras".to_owned(), true.into());
    sandbox.write("head/aside.toml", aside.to_string().as_bytes());

    let ran = sandbox.run(&["fit", "head/aside.toml", "-o", "run"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let told = format!("{}{}", ran.out, ran.err);
    assert!(told.contains("front") && told.contains("pixel"), "{told}");
    let fitted = sandbox.text("run/scene.toml");
    let (found, found_fov) = camera(&fitted, 0);
    let off = |matrix: DMat4| (matrix.w_axis - truth.w_axis).truncate().truncate().length();
    println!("{} of {}, {found_fov} of {fov} degrees", off(found), off(moved));
    // A tenth of a pixel of five.
    assert!(off(found) < 0.02 * off(moved), "{} {}", off(found), off(moved));
    // A camera further away with a longer lens shows nearly the same: with half a percent of both the head stays within an
    // eighth of a pixel, which the coverage of four samples a pixel hardly tells.
    assert!((found_fov / fov - 1.0).abs() < 5e-3, "{found_fov} {fov}");
    // It is done: another fit of the run's scene moves nothing.
    assert!(!fitted.contains("cameras = true"), "{fitted}");
    // With the cameras where they are, the constants are the built-in scene's again.
    let report = sandbox.json("run/report.json");
    assert!(report["loss"]["end"].as_f64().unwrap() < 1e-4, "{}", report["loss"]);
}
