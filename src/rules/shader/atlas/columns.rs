//! The lines of a blur that leave, beside a level, how it moves along seeds.

use std::fmt::Write as _;

/// Lines of a blur for what moves with seeds.
#[derive(Default)]
pub(super) struct Columns {
    /// Whether kernels move by their deviation alone.
    pub(super) by_deviation: bool,
    pub(super) before: String,
    pub(super) sums: String,
    pub(super) slopes: String,
    pub(super) adds: String,
    pub(super) leaves: String,
}

/// How weights move, and with them the sum: `slope` (a name) being how a tap does.
fn change(k: &str, slope: &str) -> [String; 2] {
    [
        format!("    var change{k} = vec4f(0.0);\n"),
        format!(
            "            change{k} += ({slope}.y * share + tap.y * select(-{slope}.x, {slope}.x, side == 1)) * off;\n"
        ),
    ]
}

/// How the mean moves then.
pub(super) fn by_weights(k: &str) -> String {
    format!("(change{k}.xyz - change{k}.w * mean) / whole")
}

impl Columns {
    /// The change that all movers of a Gaussian share.
    pub(super) fn share(&mut self, slope: &str) {
        let [sum, add] = change("", "slope");
        self.sums.push_str(&sum);
        let _ = writeln!(self.slopes, "        let slope: vec2f = {slope};");
        self.adds.push_str(&add);
    }

    /// A seed that moves the kernel; `levels` are the lines that read what its slope takes.
    pub(super) fn mover(&mut self, k: usize, levels: &str, call: &str) {
        if self.by_deviation {
            let _ = write!(
                self.before,
                "    var deviation_moves{k}: f32;\n    {{\n{levels}    deviation_moves{k} = {call};\n    }}\n"
            );
            return;
        }
        let (name, index) = (format!("slope{k}"), k.to_string());
        let [sum, add] = change(&index, &name);
        self.sums.push_str(&sum);
        let _ =
            write!(self.slopes, "        var {name}: vec2f;\n    {{\n{levels}    {name} = {call};\n    }}\n");
        self.adds.push_str(&add);
    }

    /// A seed that moves what is blurred, as that level has it.
    pub(super) fn blurred(&mut self, k: usize, level: &str) {
        let _ = writeln!(
            self.sums,
            "    let own{k} = level_texel({level}, here).xyz;\n    var sum{k} = vec3f(0.0);"
        );
        let _ =
            writeln!(self.adds, "            sum{k} += weight * (level_texel({level}, place).xyz - own{k});");
    }

    /// What a seed leaves.
    pub(super) fn left(&mut self, k: usize, level: &str, blurred: bool, moves: bool) {
        let own = if blurred { format!("own{k}") } else { "vec3f(0.0)".to_owned() };
        let mut parts = Vec::new();
        if blurred {
            parts.push(format!("sum{k} / whole"));
        }
        if moves && self.by_deviation {
            parts.push(format!("deviation_moves{k} * {}", by_weights("")));
        } else if moves {
            parts.push(by_weights(&k.to_string()));
        }
        let off = parts.join(" + ");
        let _ = writeln!(
            self.leaves,
            "    leave({level}, here, vec4f({own} + select(vec3f(0.0), {off}, weighs), middle.w));"
        );
    }
}
