//! `skinfit info`: the processor, the graphics adapters, and which will be used.

use super::machine::processor;
use super::{Exit, Refusal, quieten_graphics, say};

/// Print graphics adapters, their limits, what will be used and why
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  skinfit info\n  skinfit info --json")]
pub(super) struct Arguments {
    /// Part of the name of the graphics adapter to use [default: $WGPU_ADAPTER_NAME, or the fastest kind].
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    quieten_graphics();
    let report = Report::new(arguments.adapter.as_deref());
    if arguments.json {
        say(&serde_json::to_string_pretty(&report)?)?;
    } else {
        say(report.text().trim_end())?;
    }
    Ok(Exit::Done)
}

/// The program, the processor and the graphics adapters.
#[derive(serde::Serialize)]
struct Report {
    version: &'static str,
    cpu: Cpu,
    adapters: Vec<Adapter>,
    /// The engine that `render` uses by default: `gpu` or `cpu`.
    engine: &'static str,
    /// The adapter that it uses.
    #[serde(skip_serializing_if = "Option::is_none")]
    adapter: Option<String>,
    why: String,
}

#[derive(serde::Serialize)]
struct Cpu {
    processor: String,
    threads: usize,
    instructions: String,
}

/// A graphics adapter.
#[derive(serde::Serialize)]
struct Adapter {
    name: String,
    kind: &'static str,
    interface: String,
    driver: String,
    max_texture_side: u32,
    max_buffer_bytes: u64,
    max_storage_binding_bytes: u64,
    features: Vec<Feature>,
}

/// Something that is used where an adapter has it.
#[derive(serde::Serialize)]
struct Feature {
    name: &'static str,
    there: bool,
    used_for: &'static str,
}

impl Report {
    fn new(wanted: Option<&str>) -> Self {
        let cpu = Cpu {
            processor: processor(),
            threads: rayon::current_num_threads(),
            instructions: crate::simd::instructions(),
        };
        let (adapters, choice) = graphics::adapters(wanted);
        let (adapter, why) = match choice {
            Ok((name, why)) => (Some(name), why),
            Err(why) => (None, why),
        };
        let engine = if adapter.is_some() { "gpu" } else { "cpu" };
        Self { version: env!("CARGO_PKG_VERSION"), cpu, adapters, engine, adapter, why }
    }

    fn text(&self) -> String {
        let mut lines = vec![
            format!("skinfit {}", self.version),
            format!("CPU: {}, {} threads, {}", self.cpu.processor, self.cpu.threads, self.cpu.instructions),
        ];
        for adapter in &self.adapters {
            lines.push(format!("adapter: {} ({}, {})", adapter.name, adapter.kind, adapter.interface));
            lines.push(format!("  driver: {}", adapter.driver));
            let side = adapter.max_texture_side;
            lines.push(format!("  textures up to {side} x {side} texels"));
            let mebibytes = |bytes: u64| bytes >> 20;
            lines.push(format!(
                "  buffers up to {} MiB, of which a shader reads {} MiB",
                mebibytes(adapter.max_buffer_bytes),
                mebibytes(adapter.max_storage_binding_bytes)
            ));
            for feature in &adapter.features {
                let there = if feature.there { "yes" } else { "no" };
                lines.push(format!("  {}: {there} (for {})", feature.name, feature.used_for));
            }
        }
        match &self.adapter {
            Some(name) => lines.push(format!("render uses: the GPU engine on {name}: {}", self.why)),
            None => lines.push(format!("render uses: the CPU engine: {}", self.why)),
        }
        lines.push("fit uses: the CPU engine".to_owned());
        lines.join("\n")
    }
}

mod graphics {
    use super::super::graphics::Task;
    use super::{Adapter, Feature};
    use crate::gpu::adapter::{self, ADAPTER_VARIABLE, Choice, WELCOME, kind_in_words};

    /// Every adapter; and the name of the one that is used and why, or why none is.
    pub(super) fn adapters(wanted: Option<&str>) -> (Vec<Adapter>, Result<(String, String), String>) {
        let adapters: Vec<Adapter> = adapter::adapters().iter().map(describe).collect();
        let choice = Choice { name: wanted.map(str::to_owned), ..Choice::default() };
        let chosen = adapter::choose(&choice).map_err(|error| Task::Study.words(&error)).map(|chosen| {
            let info = chosen.get_info();
            let why = if wanted.is_some() {
                "--adapter names it".to_owned()
            } else if std::env::var(ADAPTER_VARIABLE).is_ok_and(|name| !name.is_empty()) {
                format!("{ADAPTER_VARIABLE} names it")
            } else if adapters.len() == 1 {
                "it is the only adapter".to_owned()
            } else {
                format!("first of the kinds: {}", kind_in_words(info.device_type))
            };
            (info.name, why)
        });
        (adapters, chosen)
    }

    fn describe(adapter: &wgpu::Adapter) -> Adapter {
        let (info, limits, features) = (adapter.get_info(), adapter.limits(), adapter.features());
        let feature =
            |&(feature, name, used_for)| Feature { name, there: features.contains(feature), used_for };
        Adapter {
            name: info.name,
            kind: kind_in_words(info.device_type),
            interface: format!("{:?}", info.backend),
            driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
            max_texture_side: limits.max_texture_dimension_2d,
            max_buffer_bytes: limits.max_buffer_size,
            max_storage_binding_bytes: limits.max_storage_buffer_binding_size,
            features: WELCOME.iter().map(feature).collect(),
        }
    }
}
