//! Animations at their own speed, around and around, with occlusion at a rate of its own.

use serde_json::Value;

use super::sandbox::Sandbox;

/// The pictures of a sequence, in their order.
pub(super) fn frames(sandbox: &Sandbox, stem: &str) -> Vec<Vec<[f32; 3]>> {
    (0..)
        .map(|i| format!("{stem}.{i:04}.exr"))
        .take_while(|name| sandbox.path(name).exists())
        .map(|name| crate::fixtures::read_exr(&sandbox.path(&name)).rgb(["R", "G", "B"]))
        .collect()
}

/// The mean difference of two pictures.
fn apart(sandbox: &Sandbox, a: &str, b: &str) -> f64 {
    let [a, b] = [a, b].map(|name| crate::fixtures::read_exr(&sandbox.path(name)).rgb(["R", "G", "B"]));
    let differences = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| f64::from((a - b).abs()));
    differences.sum::<f64>() / (3 * a.len()) as f64
}

#[test]
fn an_animation_goes_at_its_own_speed_and_around() {
    let sandbox = Sandbox::with_shared_bakes();
    sandbox.run(&["demo", "head"]).done();
    let held: Value =
        serde_json::from_str(&sandbox.run(&["inspect", "head/head.glb", "--json"]).done().out).unwrap();
    let seconds = held["animations"][0]["seconds"].as_f64().unwrap();
    let render = |more: &[&str], to: &str| {
        let begin = ["render", "head/scene.toml", "--engine", "cpu", "--size", "48x48", "--effects"];
        let all = [&begin[..], &["diffuse,occlusion,skin,morph", "--animate", "-o", to], more].concat();
        sandbox.run(&all).done();
    };
    render(&["--fps", "2"], "once.exr");
    let once = frames(&sandbox, "once");
    assert_eq!(once.len(), (2.0 * seconds).floor() as usize + 1);
    assert!(once.windows(2).all(|pair| pair[0] != pair[1]));
    render(&["--fps", "2", "--loops", "2"], "twice.exr");
    let twice = frames(&sandbox, "twice");
    assert_eq!(twice.len(), (4.0 * seconds).round() as usize);
    // A round of whole frames comes again to the bit; each begins where the first does.
    let half = twice.len() / 2;
    assert!(twice[..half] == once[..half] && twice[half] == twice[0]);
    if (2.0 * seconds).fract() == 0.0 {
        assert!(twice[..half] == twice[half..]);
    }

    // Poses at every second frame: those frames have their own, the others one between.
    render(&["--fps", "2", "--occlusion", "frames"], "each.exr");
    render(&["--fps", "2", "--occlusion", "frames", "--occlusion-rate", "1"], "some.exr");
    let (each, some) = (frames(&sandbox, "each"), frames(&sandbox, "some"));
    assert_eq!(each.len(), some.len());
    assert!(each[0] == some[0] && each[2] == some[2] && each[1] != some[1]);
    // A rate that the animation's length is no multiple of: its last frame is the last key all the same.
    render(&["--fps", "2", "--occlusion", "frames", "--occlusion-rate", "0.7"], "odd.exr");
    let odd = frames(&sandbox, "odd");
    assert!(odd.first() == each.first() && odd.last() == each.last());
    // What a line misses of the frame's own occlusion is far below what the frame differs by from the next.
    let missed = apart(&sandbox, "each.0001.exr", "some.0001.exr");
    let motion = apart(&sandbox, "each.0001.exr", "each.0002.exr");
    assert!(missed < 0.1 * motion, "{missed} {motion}");
}
