//! The cameras of a fitted scene's file, where the fit moved them.

use toml_edit::{Array, DocumentMut, Item, TableLike, Value};

use super::fitted_scene::set;
use crate::prepare::MovedCamera;
use crate::scene::view::Camera;

/// Have each view of a scene file the camera that it was fitted with, and no fit of it move cameras again.
pub(super) fn set_cameras(scene: &mut DocumentMut, cameras: &[MovedCamera]) {
    if cameras.is_empty() {
        return;
    }
    let set_one = |view: &mut dyn TableLike| {
        let name = view.get("name").and_then(Item::as_str);
        if let Some(moved) = cameras.iter().find(|moved| Some(moved.view.as_str()) == name) {
            set_camera(view, &moved.after);
        }
    };
    match scene.get_mut("view") {
        Some(Item::ArrayOfTables(views)) => views.iter_mut().for_each(|view| set_one(view)),
        Some(Item::Value(Value::Array(views))) => {
            views.iter_mut().filter_map(Value::as_inline_table_mut).for_each(|view| set_one(view));
        }
        _ => {}
    }
    if let Some(fit) = scene.get_mut("fit").and_then(Item::as_table_like_mut) {
        fit.remove("cameras");
    }
}

fn set_camera(view: &mut dyn TableLike, camera: &Camera) {
    for key in ["eye", "look_at", "up", "camera"] {
        view.remove(key);
    }
    let rows = camera.world_to_camera.transpose().to_cols_array();
    set(view, "world_to_camera", Value::Array(Array::from_iter(rows)));
    set(view, "fov_y_degrees", degrees(camera.fov_y).into());
    // The focal length across goes with the one down.
    let focal = 0.5 * f64::from(camera.height) / (0.5 * camera.fov_y).tan();
    if let Some(lens) = view.get_mut("lens").and_then(Item::as_table_like_mut)
        && lens.contains_key("fx")
    {
        let across = camera.lens.ratio * focal;
        set(lens, "fx", read_as(across, |fx| fx / focal == camera.lens.ratio).into());
    }
}

/// Degrees that are read as these radians, to the last digit where there are some.
fn degrees(radians: f64) -> f64 {
    read_as(radians.to_degrees(), |degrees| degrees.to_radians() == radians)
}

/// The number, or one of its neighbours, of which a reader makes what is wanted.
fn read_as(number: f64, wanted: impl Fn(f64) -> bool) -> f64 {
    let near = [number, number.next_up(), number.next_down()];
    near.into_iter().find(|number| wanted(*number)).unwrap_or(number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat4, DVec3};

    #[test]
    fn a_view_has_the_camera_that_it_was_fitted_with() {
        let before = Camera::pinhole(DMat4::IDENTITY, 0.5, [4, 4]);
        let world_to_camera =
            DMat4::from_rotation_x(0.1) * DMat4::from_translation(DVec3::new(0.1, 0.2, -3.0));
        let after = Camera { world_to_camera, fov_y: 0.6, ..before };
        let moved = MovedCamera { view: "a".to_owned(), before, after, pixels: [1.0, 2.0], settled: true };
        let views = [
            "[[view]]\nname = \"a\" # first\neye = [0, 0, 1]\nlook_at = [0, 0, 0]\nlens = { fx = 3.0 }\n\n[[view]]\nname = \"b\"\n",
            "view = [{ name = \"a\", camera = \"x\", lens = { fx = 3.0 } }, { name = \"b\" }]\n",
        ];
        for text in views {
            let mut scene: DocumentMut =
                format!("{text}[fit]\ncameras = true\ngains = true\n").parse().unwrap();
            set_cameras(&mut scene, std::slice::from_ref(&moved));
            let table: toml::Table = scene.to_string().parse().unwrap();
            let view = table["view"][0].as_table().unwrap();
            let rows: Vec<f64> = view["world_to_camera"]
                .as_array()
                .unwrap()
                .iter()
                .filter_map(toml::Value::as_float)
                .collect();
            // To the last digit.
            assert_eq!(rows, after.world_to_camera.transpose().to_cols_array());
            assert!(view["fov_y_degrees"].as_float().unwrap().to_radians() == 0.6);
            assert!((view["lens"]["fx"].as_float().unwrap() - 2.0 / 0.3_f64.tan()).abs() < 1e-12);
            assert!(["eye", "look_at", "camera"].iter().all(|key| !view.contains_key(*key)), "{scene}");
            assert!(table["view"][1].as_table().unwrap().len() == 1);
            assert!(table["fit"].as_table().unwrap().len() == 1, "{scene}");
        }
    }
}
