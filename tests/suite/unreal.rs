//! Nodes of Unreal's material editor: read back as its own text, wrapped and compiled as its material compiler does, by what is
//! documented of both. The editor itself is not run.

use std::collections::{BTreeSet, HashMap};

use skinfit::export::{self, Provenance, Target};
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::params::Params;
use skinfit::model::texture_filter::TextureFilter;
use skinfit::scene::{LoadOptions, Scene};
use skinfit::shader::Facts;
use skinfit::shader::facts::MapFacts;

use crate::exports::{compile_stage, engine_facts};
use crate::lit::quad;

/// What Unreal's `Common.ush` and material template declare of what a node's code sees.
pub(crate) const COMMON: &str = "#define MaterialFloat float
#define MaterialFloat2 float2
#define MaterialFloat3 float3
#define MaterialFloat4 float4
struct FMaterialPixelParameters { float4 SvPosition; };
float4 Texture2DSample(Texture2D Tex, SamplerState Sampler, float2 UV) { return Tex.Sample(Sampler, UV); }
";

/// A text between two others; what follows it.
fn between<'a>(text: &'a str, before: &str, after: &str) -> Option<(&'a str, &'a str)> {
    text.split_once(before)?.1.split_once(after)
}

/// A pin: its number, its name, and the nodes and pins that it is linked to.
struct Pin<'a> {
    id: &'a str,
    name: &'a str,
    output: bool,
    links: Vec<(&'a str, &'a str)>,
}

/// A node of the graph, as it stands on the clipboard.
struct Object<'a> {
    graph: &'a str,
    class: &'a str,
    properties: Vec<(&'a str, &'a str)>,
    pins: Vec<Pin<'a>>,
}

impl<'a> Object<'a> {
    fn of(block: &'a str) -> Self {
        let pin = |line: &'a str| {
            let links = between(line, "LinkedTo=(", ",)").map_or("", |(links, _)| links);
            Pin {
                id: between(line, "PinId=", ",").unwrap().0,
                name: between(line, "PinName=\"", "\"").unwrap().0,
                output: line.contains("Direction=\"EGPD_Output\""),
                links: links.split(',').filter_map(|link| link.split_once(' ')).collect(),
            }
        };
        let properties = block.lines().filter_map(|line| line.strip_prefix("      ")?.split_once('='));
        Self {
            graph: between(block, " Name=\"", "\"").unwrap().0,
            class: between(block, "/Script/Engine.MaterialExpression", " ").unwrap().0,
            properties: properties.collect(),
            pins: block
                .lines()
                .filter_map(|line| line.strip_prefix("   CustomProperties "))
                .map(pin)
                .collect(),
        }
    }

    fn property(&self, name: &str) -> &'a str {
        self.known(name).unwrap_or_else(|| panic!("{}: no {name}", self.graph))
    }

    fn known(&self, name: &str) -> Option<&'a str> {
        self.properties.iter().find(|(known, _)| *known == name).map(|(_, value)| *value)
    }
}

fn objects(text: &str) -> Vec<Object<'_>> {
    text.split("Begin Object Class=/Script/UnrealEd.").skip(1).map(Object::of).collect()
}

/// The *Custom* node of a material: what its code declares, the code after that, its inputs with their types, and the file
/// that it includes.
pub(crate) struct Custom {
    declared: String,
    body: String,
    pub(crate) inputs: Vec<(String, &'static str)>,
    included: Option<String>,
}

impl Custom {
    pub(crate) fn of(text: &str) -> Self {
        let objects = objects(text);
        let custom = objects.iter().find(|object| object.class == "Custom").unwrap();
        assert_eq!((custom.property("OutputType"), custom.graph.contains("_Custom_")), ("CMOT_Float3", true));
        let code = custom.property("Code");
        let code = code.strip_prefix('"').and_then(|code| code.strip_suffix('"')).unwrap();
        let code = code.replace("\\r\\n", "\n").replace("\\\"", "\"").replace("\\\\", "\\");
        let at = code.find("\nSkinfitSurface at;").unwrap() + 1;
        let kind = |pin: &Pin<'_>| {
            let [(from, _)] = pin.links[..] else { panic!("{} has not one link", pin.name) };
            let from = objects.iter().find(|object| object.graph == from).unwrap();
            match from.class {
                "TextureObjectParameter" if from.property("Texture").contains("Engine.TextureCube'") => {
                    "TextureCube"
                }
                "TextureObjectParameter" => "Texture2D",
                "TextureCoordinate" => "MaterialFloat2",
                _ => "MaterialFloat3",
            }
        };
        let inputs = custom.pins.iter().filter(|pin| !pin.output);
        Self {
            declared: code[..at].to_owned(),
            body: code[at..].to_owned(),
            inputs: inputs.map(|pin| (pin.name.to_owned(), kind(pin))).collect(),
            included: custom.known("IncludeFilePaths(0)").map(|path| path.trim_matches('"').to_owned()),
        }
    }

    /// The function that Unreal makes of the node. glslang takes no functions within functions, so what the code declares stands
    /// before it, as that of an included file does.
    pub(crate) fn function(&self) -> String {
        let parameter = |(name, kind): &(String, &str)| match *kind {
            "Texture2D" | "TextureCube" => format!(",{kind} {name}, SamplerState {name}Sampler "),
            _ => format!(",{kind} {name}"),
        };
        let parameters: String = self.inputs.iter().map(parameter).collect();
        format!(
            "{COMMON}{}\nMaterialFloat3 CustomExpression0(FMaterialPixelParameters Parameters{parameters})\n{{\n{}\n}}\n",
            self.declared, self.body
        )
    }

    /// A call of it, with what `given` makes of each input that is no texture.
    pub(crate) fn call(&self, given: impl Fn(&str) -> String) -> String {
        let argument = |(name, kind): &(String, &str)| match *kind {
            "Texture2D" | "TextureCube" => format!(", bound_{name}, bound_{name}Sampler"),
            _ => format!(", {}", given(name)),
        };
        let arguments: String = self.inputs.iter().map(argument).collect();
        format!(
            "    FMaterialPixelParameters Parameters;\n    Parameters.SvPosition = float4(0.0, 0.0, 0.0, 0.0);\n    \
             return float4(CustomExpression0(Parameters{arguments}), 1.0);\n"
        )
    }

    /// A fragment stage that calls it.
    fn stage(&self) -> String {
        let (mut bound, mut fields) = (String::new(), Vec::new());
        for (name, kind) in &self.inputs {
            match *kind {
                "Texture2D" | "TextureCube" => {
                    bound += &format!("{kind} bound_{name};\nSamplerState bound_{name}Sampler;\n");
                }
                _ => fields.push(format!("{kind} in_{name} : TEXCOORD{}", fields.len())),
            }
        }
        let call = self.call(|name| format!("in_{name}"));
        let function = self.function();
        format!("{function}{bound}float4 main({}) : SV_Target {{\n{call}}}\n", fields.join(", "))
    }
}

/// Unreal's text as plain HLSL: its textures declared, and functions that hand them to its struct's.
pub(crate) fn unreal_in_hlsl(exported: &str) -> String {
    let (mut declared, mut functions) = (BTreeSet::new(), String::new());
    for line in exported.lines().filter_map(|line| line.strip_prefix("    ")) {
        let Some((head, list)) = line.strip_suffix(") {").and_then(|line| line.split_once('(')) else {
            continue;
        };
        let Some((kind, name)) = head.split_once(" skinfit_") else { continue };
        let texture = |word: &&str| ["Texture", "Sampler"].iter().any(|kind| word.starts_with(kind));
        let (handed, own): (Vec<&str>, Vec<&str>) = list.split(", ").partition(texture);
        let arguments: Vec<&str> = list.split(", ").filter_map(|word| word.split(' ').next_back()).collect();
        declared.extend(handed.iter().map(|word| format!("{word};\n")));
        if name == "shade" || name.ends_with("_pass") {
            functions += &format!(
                "{kind} skinfit_{name}({}) {{\n    Skinfit skin;\n    return skin.skinfit_{name}({});\n}}\n",
                own.join(", "),
                arguments.join(", ")
            );
        }
    }
    format!("{COMMON}{exported}\n{}{functions}", declared.into_iter().collect::<String>())
}

/// Scenes whose materials differ.
fn scenes() -> Vec<Facts> {
    let of = |effects| Facts {
        setup: Setup::new(Form::Corrected, Silhouette::Fragment, effects),
        ..engine_facts()
    };
    let maps = MapFacts { filter: TextureFilter::Trilinear, ..engine_facts().maps };
    vec![
        of(Effects::SURFACE),
        of(Effects::of(&[Effect::Diffuse])),
        of(Effects::SURFACE.with(Effect::KeyLight).with(Effect::Haze)),
        Facts { maps, ..of(Effects::SURFACE) },
    ]
}

fn material(facts: &Facts, name: &str) -> String {
    export::material(Target::Unreal, facts, &Params::defaults(facts.setup.form), name).unwrap()
}

#[test]
fn the_node_is_hlsl_as_unreal_wraps_it() {
    for facts in scenes() {
        let custom = Custom::of(&material(&facts, "Skin"));
        assert!(
            custom.included.is_none() && custom.declared.contains("struct Skinfit {"),
            "{}",
            custom.declared
        );
        // By a path of a shader directory, the text is a file's.
        let by_path = Custom::of(&material(&facts, "/Project/Skin.ush"));
        assert_eq!(by_path.included.as_deref(), Some("/Project/Skin.ush"));
        assert!(!by_path.declared.contains("struct") && by_path.body == custom.body);
        let params = Params::defaults(facts.setup.form);
        let shader = export::function(Target::Unreal, &facts, &params, &Provenance::default()).unwrap();
        let of_file = Custom { declared: shader, ..by_path };
        for (name, custom) in [("within", custom), ("by a path", of_file)] {
            let text = custom.stage();
            let found = compile_stage("frag", "main", &text);
            found.unwrap_or_else(|error| panic!("{name}: {error}\n{text}"));
            for (right, wrong) in [("at.vertex_normal =", "at.normal ="), (".xzy", ".xzq"), ("Sampler)", ")")]
            {
                let spoilt = text.replacen(right, wrong, 1);
                assert!(spoilt != text && compile_stage("frag", "main", &spoilt).is_err(), "{name}: {wrong}");
            }
        }
    }
}

#[test]
fn what_is_pasted_is_whole_and_linked_both_ways() {
    for facts in scenes() {
        let text = material(&facts, "Skin \"1\"");
        assert_eq!(text.matches("Begin Object ").count(), text.matches("End Object\n").count());
        assert_eq!(text.matches("Begin Object ").count(), 3 * objects(&text).len());
        let objects = objects(&text);
        let nodes: HashMap<&str, &Object<'_>> = objects.iter().map(|object| (object.graph, object)).collect();
        assert_eq!(nodes.len(), objects.len(), "two nodes have one name");
        let pins = || objects.iter().flat_map(|object| object.pins.iter().map(move |pin| (object, pin)));
        let ids: BTreeSet<&str> = pins().map(|(_, pin)| pin.id).collect();
        assert!(ids.len() == pins().count() && ids.iter().all(|id| id.len() == 32), "{text}");
        for (object, pin) in pins() {
            for (node, id) in &pin.links {
                let other = nodes[node].pins.iter().find(|other| other.id == *id).unwrap();
                assert!(other.output != pin.output, "{}: {} is linked to its like", object.graph, pin.name);
                assert!(
                    other.links.contains(&(object.graph, pin.id)),
                    "{}: {} alone",
                    object.graph,
                    pin.name
                );
            }
        }
        // Every node but the shader's own gives something to another, and what takes has one link.
        for object in &objects {
            let output = object.pins.iter().find(|pin| pin.output).unwrap();
            assert_eq!(output.links.is_empty(), object.class == "Custom", "{}", object.graph);
            assert!(object.pins.iter().all(|pin| pin.output || pin.links.len() == 1), "{}", object.graph);
        }
        // Inputs stand in the order of their pins.
        let custom = objects.iter().find(|object| object.class == "Custom").unwrap();
        for (i, pin) in custom.pins.iter().filter(|pin| !pin.output).enumerate() {
            let input = custom.property(&format!("Inputs({i})"));
            assert!(input.starts_with(&format!("(InputName=\"{}\",", pin.name)), "{input}");
        }
        assert_eq!(custom.property("Description"), "\"Skin 1\"");
        // Colours alone are decoded.
        for texture in objects.iter().filter(|object| object.class == "TextureObjectParameter") {
            let color = texture.property("ParameterName") == "\"skinfit_color_map\"";
            let sampler = if color { "SAMPLERTYPE_Color" } else { "SAMPLERTYPE_LinearColor" };
            assert_eq!(texture.property("SamplerType"), sampler);
        }
        assert!(text.contains("/Script/Engine.TextureCube'/Game/irradiance.irradiance'"), "{text}");
    }
}

/// What the code makes of an input: a factor, its name, and the input's components in their order.
fn turned(value: &str) -> (f64, &str, [usize; 3]) {
    let (factor, value) = match value.strip_prefix('-') {
        Some(value) => (-1.0, value),
        None => {
            value.split_once(" * ").map_or((1.0, value), |(factor, value)| (factor.parse().unwrap(), value))
        }
    };
    let (name, components) = value.split_once('.').unwrap();
    let index = |c: char| "xyz".find(c).unwrap();
    (factor, name, components.chars().map(index).collect::<Vec<_>>().try_into().unwrap())
}

#[test]
fn what_unreals_importer_turned_goes_in_along_gltfs_axes() {
    // `GLTF::ConvertVec3` of Unreal's importer, and its scale.
    let imported = |[x, y, z]: [f64; 3], scale: f64| [x, z, y].map(|x| scale * x);
    let custom = Custom::of(&material(&scenes()[0], "Skin"));
    let gltf = [0.3, -1.7, 0.06];
    for (name, scale, sign) in [
        ("vertex_position", 100.0, 1.0),
        ("vertex_normal", 1.0, 1.0),
        ("vertex_tangent", 1.0, 1.0),
        // Normal maps of glTF have Y up, Unreal's have it down.
        ("vertex_bitangent", 1.0, -1.0),
    ] {
        let (value, _) = between(&custom.body, &format!("at.{name} = "), ";").unwrap();
        let (factor, input, components) = turned(value);
        let given = imported(gltf, scale);
        let got = components.map(|c| sign * factor * given[c]);
        assert_eq!(input, name);
        assert!(got.iter().zip(gltf).all(|(a, b)| (a - b).abs() < 1e-12), "{name}: {got:?} {gltf:?}");
    }
    // Places are from the eye.
    let text = material(&scenes()[0], "Skin");
    assert!(text.contains("WorldPositionShaderOffset=WPT_CameraRelative"), "{text}");
    assert!(custom.body.contains("at.eye = float3(0.0, 0.0, 0.0);"), "{}", custom.body);
}

#[test]
fn lights_that_stand_somewhere_are_refused() {
    let folder = quad("\"diffuse\", \"lights\"", "");
    let options = LoadOptions { targets: false, ..LoadOptions::default() };
    let (scene, _) = Scene::load(&folder.path("scene.toml"), &options).unwrap();
    let facts = Facts { tessellation: 1.0, ..scene.facts(&scene.params, export::BUDGET, false) };
    let error = export::material(Target::Unreal, &facts, &scene.params, "Skin").unwrap_err().to_string();
    assert!(error.contains("places in the scene (light_lamp_"), "{error}");
    assert!(error.contains("which no material file hands over"), "{error}");
}
