//! Bakes, caches, effects and layers.

use std::collections::{BTreeMap, BTreeSet};

use base64::Engine as _;
use skinfit::render::files::Image;
use skinfit::report::pictures::Picture;

use super::sandbox::{Sandbox, TRUTH, files};
use crate::fixtures::read_exr;

const ALL: [&str; 7] = ["diffuse", "normal_map", "occlusion", "rim", "side_specular", "hilite", "reflection"];

#[test]
fn a_second_run_bakes_nothing_again() {
    let sandbox = Sandbox::new();
    let bake = |to: &str| sandbox.run(&["bake", "scene.toml", "-o", to]);
    let first = bake("a").done();
    assert!(first.out.contains("occlusion  baked") && !first.out.contains("kept"), "{first:?}");
    let second = bake("b").done();
    assert!(second.out.contains("occlusion  kept") && !second.out.contains("  baked"), "{second:?}");
    let contents = |folder: &str| files(&sandbox.path(folder)).into_values().collect::<Vec<_>>();
    assert!(contents("a") == contents("b"));
    // What a fit baked serves a picture too.
    sandbox.fit("run", &[]).done();
    let kept = files(sandbox.cache());
    sandbox
        .run(&["render", "--engine", "cpu", "scene.toml", "--params", "run/params.toml", "-o", "a.png"])
        .done();
    assert!(files(sandbox.cache()) == kept, "a picture baked anew");
}

#[test]
fn a_damaged_cache_is_noticed_and_made_anew() {
    let sandbox = Sandbox::new();
    sandbox.fit("a", &[]).done();
    let kept = files(sandbox.cache());
    for (path, bytes) in &kept {
        let mut damaged = bytes.clone();
        let last = damaged.len() - 1;
        damaged[last] ^= 1;
        std::fs::write(path, &damaged).unwrap();
    }
    let ran = sandbox.fit("b", &[]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(ran.err.matches("baking anew").count(), kept.len(), "{ran:?}");
    assert_eq!(sandbox.text("a/params.toml"), sandbox.text("b/params.toml"));
    assert!(files(sandbox.cache()) == kept);
    sandbox.fit("c", &[]).done();
}

#[test]
fn a_cache_that_cannot_be_written_costs_a_warning_alone() {
    let sandbox = Sandbox::new();
    sandbox.write("file", b"");
    let ran = sandbox.fit("run", &["--cache", "file/cache"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(ran.err.lines().count(), 1, "{ran:?}");
    assert!(ran.err.contains("warning: file/cache/") && ran.err.contains("not kept"), "{ran:?}");
    let kept = files(sandbox.cache());
    sandbox.fit("run", &["--no-cache"]).done();
    assert!(files(sandbox.cache()) == kept, "--no-cache kept something");
}

/// The names that `bake` writes for a list of effects, without their endings.
fn baked(sandbox: &Sandbox, effects: &str) -> BTreeSet<String> {
    let folder = format!("baked_{}", effects.replace(',', "_"));
    let ran = sandbox.run(&["bake", "scene.toml", "--effects", effects, "-o", &folder]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    if !sandbox.path(&folder).is_dir() {
        assert!(ran.err.contains("ask for no bake"), "{ran:?}");
        return BTreeSet::new();
    }
    let names = std::fs::read_dir(sandbox.path(&folder)).unwrap();
    names
        .map(|entry| entry.unwrap().path().file_stem().unwrap().to_str().unwrap().to_owned())
        .filter(|name| name != ".lock")
        .map(|name| if name.starts_with("lobe_") { "lobe".to_owned() } else { name })
        .collect()
}

#[test]
fn an_effect_that_is_off_is_not_baked() {
    let sandbox = Sandbox::new();
    // The scene's own would be refused; none of these asks for them.
    for (effects, bakes) in [
        (ALL.join(",").as_str(), &["irradiance", "lobe", "hilite", "occlusion"][..]),
        ("diffuse", &["irradiance"]),
        ("diffuse,rim,normal_map", &["irradiance"]),
        ("diffuse,occlusion", &["irradiance", "occlusion"]),
        ("hilite", &["hilite"]),
        ("hilite,occlusion", &["hilite", "occlusion"]),
        ("side_specular", &["lobe"]),
        ("reflection", &["lobe"]),
        ("occlusion,side_specular", &["lobe"]),
        ("key_light,normal_map", &[]),
        ("diffuse,directional_occlusion", &["irradiance", "vertices"]),
        ("directional_occlusion", &[]),
    ] {
        let bakes: BTreeSet<String> = bakes.iter().map(|&name| name.to_owned()).collect();
        assert_eq!(baked(&sandbox, effects), bakes, "{effects}");
    }
}

#[test]
fn what_vertices_see_of_the_sky_is_a_table() {
    let sandbox = Sandbox::new();
    sandbox.edit("[model.params]", "specular_visibility = \"cone\"\n[model.params]");
    let effects = "diffuse,occlusion,directional_occlusion,fresnel";
    sandbox.run(&["bake", "scene.toml", "--effects", effects, "-o", "baked"]).done();
    let text = sandbox.text("baked/vertices.csv");
    let mut lines = text.lines();
    let columns: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = |name: &str| {
        columns.iter().position(|column| *column == name).unwrap_or_else(|| panic!("{name}: {columns:?}"))
    };
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    let open = sandbox.text("baked/occlusion.csv");
    assert_eq!(rows.len(), open.lines().count() - 1);
    let [bent, ratio] = ["bent_normal_1", "sky_ratio_1"].map(at);
    let (mut hidden, mut whole, mut lone) = (0, 0, 0);
    for (vertex, row) in rows.iter().enumerate() {
        assert_eq!(row.len(), columns.len());
        assert_eq!(row[0], vertex as f64);
        let length = row[bent..bent + 3].iter().map(|x| x * x).sum::<f64>().sqrt();
        if length == 0.0 {
            // Of no triangle, as at the ball's poles.
            lone += 1;
            continue;
        }
        // As long as its share of the hemisphere, which is 1 at the most; f32 rounds it.
        assert!(length < 1.0 + 1e-6, "vertex {vertex}: {row:?}");
        let ratio = &row[ratio..ratio + 3];
        assert!(ratio.iter().all(|x| *x >= 0.0), "vertex {vertex}: {row:?}");
        hidden += usize::from(ratio.iter().all(|x| *x < 0.95));
        whole += usize::from(ratio.iter().all(|x| (x - 1.0).abs() < 1e-3));
    }
    // The brow hides some of the sky from what is below it, and nothing from the back of the ball.
    assert!(hidden > 0 && whole > 0, "{hidden} vertices in the shade, {whole} see all");
    assert!(lone < rows.len() / 10, "{lone} of {}", rows.len());
}

#[test]
fn the_stages_of_diffusion_are_pictures_of_the_atlas() {
    let sandbox = Sandbox::new();
    sandbox.edit("[quality]", "[diffusion]\nlight_map_size = 64\n[quality]");
    let bake = |effects: &str, to: &str| {
        sandbox.run(&["bake", "scene.toml", "--stages", "--effects", effects, "-o", to])
    };
    bake("diffuse,occlusion", "refused").refused(&["scene.toml: --stages", "Enable the effect `diffusion`"]);
    assert!(!sandbox.path("refused").exists());
    bake("diffuse,occlusion,diffusion", "baked").done();
    let levels = ["light_map", "level_1", "level_2", "level_3"];
    // Of what the scene's fit has free, the occlusion alone moves the light map.
    let moved = levels.map(|name| format!("{name}_by_occlusion"));
    let names =
        levels.into_iter().map(str::to_owned).chain(moved).chain(["charts", "stretch"].map(str::to_owned));
    let covered = read_exr(&sandbox.path("baked/charts.exr")).planes["A"].clone();
    // The ball's chart fills the atlas but for a triangle a column at each pole.
    assert_eq!(covered.len(), 64 * 64);
    assert!(covered.iter().filter(|&&alpha| alpha == 1.0).count() > 64 * 48);
    for name in names {
        let image = read_exr(&sandbox.path(&format!("baked/{name}.exr")));
        assert_eq!(image.planes["A"], covered, "{name}");
        assert!(image.planes["R"].iter().any(|&red| red != 0.0), "{name}");
        assert!(sandbox.path(&format!("baked/{name}.png")).is_file(), "{name}");
    }
    let made = std::fs::read_dir(sandbox.path("baked")).unwrap().count();
    // Beside these the irradiance (two files), the occlusion, the vertices' charts and the lock.
    assert_eq!(made, 2 * 10 + 2 + 1 + 1 + 1);
    // The ball is one piece.
    let charts = sandbox.text("baked/charts.csv");
    assert!(charts.starts_with("vertex,chart\n0,1\n1,1\n"), "{charts}");
    // What pixels look up where levels are added up in texels.
    sandbox.edit("light_map_size = 64", "light_map_size = 64\ncombined = \"map\"");
    bake("diffuse,occlusion,diffusion", "added_up").done();
    for name in ["sum", "sum_by_occlusion", "level_3"] {
        let image = read_exr(&sandbox.path(&format!("added_up/{name}.exr")));
        assert!(image.planes["R"].iter().any(|&red| red != 0.0), "{name}");
    }
    sandbox.edit("light_map_size = 64\ncombined = \"map\"", "light_map_size = 64");
    // What an engine makes of them is exported with the shader.
    sandbox.write("truth.toml", TRUTH.as_bytes());
    sandbox.edit("\"reflection\"]", "\"reflection\", \"diffusion\"]");
    let export = ["export", "truth.toml", "--scene", "scene.toml", "--to"];
    for (target, load) in [
        ("glsl", "texelFetch("),
        ("unity", ".Load(int3("),
        ("unreal", ".Load(int3("),
        ("msl", ".read(uint2("),
        ("cg", "tex2Dfetch("),
    ] {
        let text = sandbox.run(&[&export[..], &[target]].concat()).done().out;
        for part in ["into textures of 64 x 64 texels", "skinfit_diffusion_level_3_pass(", "charts.csv", load]
        {
            assert!(text.contains(part), "{target}: {part}");
        }
    }
    sandbox.edit("light_map_size = 64", "light_map_size = 64\nseams = \"joined\"");
    sandbox.run(&[&export[..], &["glsl"]].concat()).refused(&["across the seams", "seams = \"cut\""]);
}

/// The pictures of a report's stages of diffusion, by their names.
fn reported(page: &str) -> BTreeMap<String, image::RgbImage> {
    let begins = page.find("<section id=\"diffusion\">").unwrap();
    let section = &page[begins..begins + page[begins..].find("</section>").unwrap()];
    let figure = |figure: &str| {
        let uri = figure.split("data:image/png;base64,").nth(1).unwrap().split('"').next().unwrap();
        let png = base64::engine::general_purpose::STANDARD.decode(uri).unwrap();
        let name = figure.split("alt=\"stage ").nth(1).unwrap().split('"').next().unwrap();
        (name.to_owned(), image::load_from_memory(&png).unwrap().to_rgb8())
    };
    section.split("<figure>").skip(1).map(figure).collect()
}

#[test]
fn the_report_shows_the_stages_of_diffusion_that_the_command_writes() {
    let sandbox = Sandbox::new();
    sandbox.fit("without", &[]).done();
    assert!(!sandbox.text("without/report.html").contains("<section id=\"diffusion\">"));
    sandbox.edit("[quality]", "[diffusion]\nlight_map_size = 64\n[quality]");
    sandbox.edit("\"reflection\"]", "\"reflection\", \"diffusion\"]");
    // The image is linear in it, so that the fit converges whatever the targets are.
    let ran = sandbox.fit("run", &["--free", "base_weight"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let page = sandbox.text("run/report.html");
    let shown = reported(&page);
    let names: Vec<&str> = shown.keys().map(String::as_str).collect();
    assert_eq!(names, ["charts", "level_1", "level_2", "level_3", "light_map", "stretch"]);
    // Standard deviations of 0.6, 1.2 and 2.6 mm: the root of the sum of their squares.
    assert!(page.contains("the light map blurred by 2.93 mm"), "no radius of level 3");

    let bake = ["bake", "run/scene.toml", "--params", "run/params.toml", "--stages", "-o", "baked"];
    let baked = sandbox.run(&bake);
    assert_eq!(baked.code, Some(0), "{baked:?}");
    for (name, shown) in shown {
        let planes = read_exr(&sandbox.path(&format!("baked/{name}.exr")));
        assert_eq!([shown.width(), shown.height()], [64, 64], "{name}");
        let mut written = Image::new(64, 64);
        (written.rgb, written.alpha) = (planes.rgb(["R", "G", "B"]), planes.planes["A"].clone());
        if name == "stretch" {
            let largest = written.rgb.iter().flatten().fold(0.0_f32, |most, x| most.max(*x));
            written.rgb.iter_mut().flatten().for_each(|x| *x /= largest);
        }
        let expected = Picture::of_image(&written).bytes;
        assert!(expected.iter().max() > expected.iter().min(), "{name} shows nothing");
        // Where a file's number is rounded, a byte may be, too.
        let apart = expected.iter().zip(shown.as_raw()).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(apart <= Some(1), "{name}: {apart:?}");
    }
}

#[test]
fn an_effect_that_is_off_does_not_ask_for_its_files() {
    let render = |sandbox: &Sandbox, effects: &str| {
        sandbox.run(&["render", "--engine", "cpu", "scene.toml", "--effects", effects, "-o", "a.exr"])
    };
    let rows = [
        ("specular.png", "occlusion,diffuse", "side_specular"),
        ("attenuator.png", "diffuse,rim,side_specular,reflection", "hilite"),
        ("normal.png", "diffuse,hilite", "diffuse,normal_map"),
        ("color.png", "side_specular,hilite,reflection", "key_light"),
        ("env.exr", "key_light,normal_map", "diffuse"),
    ];
    for (file, without, with) in rows {
        let sandbox = Sandbox::new();
        sandbox.remove(file);
        render(&sandbox, without).done();
        render(&sandbox, with).refused(&[&format!("{file}: there is no such file")]);
    }
}

#[test]
fn the_layers_of_a_rendered_image_add_up_to_the_whole() {
    let sandbox = Sandbox::new();
    let render = ["render", "scene.toml", "--engine", "cpu", "--params", "truth.toml", "--layers"];
    sandbox.run(&[&render[..], &["-o", "a.exr"]].concat()).done();
    let image = read_exr(&sandbox.path("a.exr"));
    for channel in ["R", "G", "B"] {
        let layers: Vec<&Vec<f32>> = (image.planes.iter())
            .filter(|(name, _)| name.ends_with(&format!(".{channel}")))
            .map(|(_, plane)| plane)
            .collect();
        assert!(layers.len() >= 4, "{:?}", image.planes.keys());
        let brightest = image.planes[channel].iter().fold(0.0_f32, |most, &x| most.max(x));
        assert!(brightest > 0.1, "an image in the dark shows nothing");
        for (i, &whole) in image.planes[channel].iter().enumerate() {
            let sum: f32 = layers.iter().map(|layer| layer[i]).sum();
            // A handful of roundings of f32.
            assert!((sum - whole).abs() <= 1e-5 * (1.0 + whole.abs()), "pixel {i}: {sum} is not {whole}");
        }
    }
}

#[test]
fn an_image_is_rendered_in_every_kind_and_says_where_it_comes_from() {
    let sandbox = Sandbox::new();
    for (output, more) in [
        ("new/folder/a.exr", &[][..]),
        ("a.PNG", &["--tone", "aces", "--exposure", "-1.5"]),
        ("b.png", &["--tone", "reinhard", "--view", "side"]),
    ] {
        let ran =
            sandbox.run(&[&["render", "scene.toml", "-o", output, "--engine", "cpu"], more].concat()).done();
        let view = if more.contains(&"side") { "side" } else { "front" };
        assert_eq!(ran.out, format!("wrote {output} (view {view}; cpu)\n"));
    }
    let text = String::from_utf8_lossy(&sandbox.read("new/folder/a.exr")).into_owned();
    assert!(text.contains("skinfit 0") && text.contains("scene.toml") && text.contains("hilite = 0.7"));
    let (a, b) = (image::open(sandbox.path("a.PNG")).unwrap(), image::open(sandbox.path("b.png")).unwrap());
    assert_eq!((a.width(), a.height(), b.width(), b.height()), (32, 32, 32, 24));
}
