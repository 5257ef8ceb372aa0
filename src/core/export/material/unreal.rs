//! Nodes of an Unreal material as its editor copies and pastes them: a *Custom* node with the shader, and what it takes.
//!
//! Epic documents what the nodes do ("Custom Material Expressions", "Coordinates Expressions", "Vector Operation Expressions",
//! "Texture Expressions"), not the text on the clipboard. That has the form of what Unreal 5's editor copies: an object a
//! graph node, its expression within, and pins that name each other. The editor makes anew whatever else a node has.
//!
//! An include file has to lie in a folder that a module of the project maps as a shader directory, and projects without
//! C++ have none. Unless a path of such a folder is named, the node therefore holds the shader itself.

use std::fmt::Write as _;

use super::{Bound, Members, Parts};
use crate::export::ExportError;
use crate::export::dialect::UNREAL;
use crate::export::function::code;
use crate::shader::Domain;

/// Unreal's importer of glTF exchanges Y and Z, and makes centimetres of metres: exchanged once more they are glTF's. Places are
/// taken from the eye, as those of the world have a type of their own in Unreal 5 (Epic's documentation, "Large World
/// Coordinates"), which no code of a *Custom* node is to depend on. Unreal's normal maps have Y down, so its frame's Y is the
/// bitangent turned over.
const MEMBERS: Members = [
    ("vertex_position", "0.01 * vertex_position.xzy"),
    ("vertex_normal", "vertex_normal.xzy"),
    ("vertex_tangent", "vertex_tangent.xzy"),
    ("vertex_bitangent", "-vertex_bitangent.xzy"),
    ("vertex_uv", "vertex_uv"),
    ("vertex_occlusion", "vertex_occlusion.x"),
    ("eye", "float3(0.0, 0.0, 0.0)"),
];

/// The node from which the *Custom* node has each member, or several, each of which takes the one before it: class and
/// properties.
const SOURCES: [(&str, &[(&str, &str)]); 6] = [
    ("vertex_position", &[("WorldPosition", "WorldPositionShaderOffset=WPT_CameraRelative")]),
    ("vertex_normal", &[("VertexNormalWS", "")]),
    ("vertex_tangent", &[("VertexTangentWS", "")]),
    (
        "vertex_bitangent",
        &[
            ("Constant3Vector", "Constant=(R=0.000000,G=1.000000,B=0.000000,A=0.000000)"),
            ("Transform", "TransformSourceType=TRANSFORMSOURCE_Tangent\nTransformType=TRANSFORM_World"),
        ],
    ),
    ("vertex_uv", &[("TextureCoordinate", "CoordinateIndex=0")]),
    ("vertex_occlusion", &[("TextureCoordinate", "CoordinateIndex=1")]),
];

/// What the *Custom* node's code begins with.
const HEAD: &str = "// Connect it to Emissive Color of an unlit material: linear radiance, before exposure and tone mapping. Textures other than
// the colour map, and all cubes, are imported without sRGB, the normal map as one of the default kind, as it is read as
// stored. Occlusion is the first number of the second texture coordinates.
";

/// Nodes to be pasted into a material.
pub(super) fn text(parts: &Parts<'_>) -> Result<String, ExportError> {
    refuse_places(parts)?;
    let filled = parts.filled(&MEMBERS, "")?;
    let (mut nodes, mut inputs) = (Vec::new(), Vec::new());
    for (name, _) in parts.plan.surface() {
        let sources = SOURCES.iter().find(|(member, _)| *member == name).map_or(&[][..], |(_, nodes)| *nodes);
        for (i, (class, properties)) in sources.iter().enumerate() {
            let from = (i > 0).then(|| ("Input".to_owned(), nodes.len() - 1));
            nodes.push(Node {
                class,
                properties: (*properties).to_owned(),
                from: from.into_iter().collect(),
            });
        }
        if !sources.is_empty() {
            inputs.push((name.to_owned(), nodes.len() - 1));
        }
    }
    let mut arguments = String::new();
    for bound in parts.bound() {
        let _ = write!(arguments, ", {}", UNREAL.handed(&bound.name, bound.cube, true).arguments);
        nodes.push(texture(&bound));
        inputs.push((bound.name, nodes.len() - 1));
    }
    let included = parts.shader.starts_with('/');
    let shader = if included {
        String::new()
    } else {
        code(&UNREAL, parts.plan, parts.resources, parts.params) + "\n"
    };
    let code = format!(
        "{HEAD}{shader}SkinfitSurface at;\n{filled}Skinfit skin;\nreturn skin.skinfit_shade(at{arguments}).rgb;\n"
    );
    let name = quoted(&parts.shader.replace('"', ""));
    let mut properties =
        format!("Code={}\nOutputType=CMOT_Float3\nDescription={name}", quoted(&code.replace('\n', "\r\n")));
    for (i, (name, from)) in inputs.iter().enumerate() {
        let _ = write!(
            properties,
            "\nInputs({i})=(InputName=\"{name}\",Input={})",
            nodes[*from].reference(*from)
        );
    }
    if included {
        let _ = write!(properties, "\nIncludeFilePaths(0)={name}");
    }
    nodes.push(Node { class: CUSTOM, properties, from: inputs });
    Ok((0..nodes.len()).map(|i| object(&nodes, i)).collect())
}

/// A light that stands somewhere stands in the scene's world; places here are from the eye.
fn refuse_places(parts: &Parts<'_>) -> Result<(), ExportError> {
    let steps = parts.plan.all_steps();
    let rules = steps.iter().map(|step| step.rule).filter(|rule| rule.domain != Domain::Vertex);
    let needs = |needs: &[(&str, &str)], name: &str| needs.iter().any(|(known, _)| *known == name);
    let mut places = rules.filter(|rule| needs(&rule.needs, "vertex_position") && !needs(&rule.needs, "eye"));
    match places.next() {
        Some(rule) => Err(ExportError::Unfilled {
            what: format!(
                "places in the scene ({}: {}), where Unreal's material has places from the eye",
                rule.function,
                rule.about.trim_end_matches('.')
            ),
        }),
        None => Ok(()),
    }
}

/// The class of the node with the shader.
const CUSTOM: &str = "Custom";

/// A node of the material: its class, what it is set to, a property a line, and the pins that take what other nodes give.
struct Node {
    class: &'static str,
    properties: String,
    from: Vec<(String, usize)>,
}

impl Node {
    /// The name of the expression of the node with that number.
    fn expression(&self, number: usize) -> String {
        format!("MaterialExpression{}_{number}", self.class)
    }

    /// The name of the graph's node.
    fn graph(&self, number: usize) -> String {
        let own = if self.class == CUSTOM { "_Custom" } else { "" };
        format!("MaterialGraphNode{own}_{number}")
    }

    /// What takes the node's first output.
    fn reference(&self, number: usize) -> String {
        let (class, graph, expression) = (self.class, self.graph(number), self.expression(number));
        format!("(Expression=\"/Script/Engine.MaterialExpression{class}'{graph}.{expression}'\")")
    }
}

/// A texture that the project names, with what belongs there as the node's comment.
fn texture(bound: &Bound) -> Node {
    // The asset of a file has the file's name: of cubes as `skinfit bake` writes them.
    let (class, ending) = if bound.cube { ("TextureCube", "") } else { ("Texture2D", "_map") };
    let sampler = if bound.color { "Color" } else { "LinearColor" };
    let name = &bound.name;
    let asset = format!("{}{ending}", bound.short());
    Node {
        class: "TextureObjectParameter",
        properties: format!(
            "ParameterName=\"{name}\"\nTexture=\"/Script/Engine.{class}'/Game/{asset}.{asset}'\"\n\
             SamplerType=SAMPLERTYPE_{sampler}\nDesc={}",
            quoted(&bound.words.replace('"', "'"))
        ),
        from: Vec::new(),
    }
}

/// A text as a property holds it.
fn quoted(text: &str) -> String {
    let text = text.replace('\\', "\\\\").replace('"', "\\\"");
    format!("\"{}\"", text.replace('\r', "\\r").replace('\n', "\\n"))
}

/// The node with that number among its own.
fn object(nodes: &[Node], number: usize) -> String {
    let node = &nodes[number];
    let (class, graph, expression) = (node.class, node.graph(number), node.expression(number));
    let kind = graph.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end_matches('_');
    let (x, y) = if class == CUSTOM { (0, 0) } else { (-600, 160 * number) };
    let mut text = format!(
        "Begin Object Class=/Script/UnrealEd.{kind} Name=\"{graph}\"\n   Begin Object \
         Class=/Script/Engine.MaterialExpression{class} Name=\"{expression}\"\n   End Object\n   Begin Object \
         Name=\"{expression}\"\n"
    );
    for line in node.properties.lines() {
        let _ = writeln!(text, "      {line}");
    }
    for (name, from) in node.from.iter().filter(|_| class != CUSTOM) {
        let _ = writeln!(text, "      {name}={}", nodes[*from].reference(*from));
    }
    let _ = write!(
        text,
        "      MaterialExpressionEditorX={x}\n      MaterialExpressionEditorY={y}\n   End Object\n   \
         MaterialExpression=\"/Script/Engine.MaterialExpression{class}'{expression}'\"\n   NodePosX={x}\n   NodePosY={y}\n"
    );
    for (i, (name, from)) in node.from.iter().enumerate() {
        let links = format!("{} {},", nodes[*from].graph(*from), pin_id(*from, 0));
        text += &pin(&pin_id(number, i + 1), name, "PinType.PinCategory=\"required\"", &links);
    }
    let taking = |(other, node): (usize, &Node)| {
        let at = node.from.iter().position(|(_, from)| *from == number)?;
        Some(format!("{} {},", node.graph(other), pin_id(other, at + 1)))
    };
    let links: String = nodes.iter().enumerate().filter_map(taking).collect();
    text += &pin(&pin_id(number, 0), "Output", "Direction=\"EGPD_Output\"", &links);
    text + "End Object\n"
}

/// A pin's own number: of the output with 0, of inputs from 1 on.
fn pin_id(node: usize, pin: usize) -> String {
    format!("{:032X}", 0x100 * (node + 1) + pin)
}

fn pin(id: &str, name: &str, kind: &str, links: &str) -> String {
    let links = if links.is_empty() { String::new() } else { format!("LinkedTo=({links}),") };
    format!(
        "   CustomProperties Pin (PinId={id},PinName=\"{name}\",{kind},{links}PersistentGuid={:032},bHidden=False,\
         bNotConnectable=False,bDefaultValueIsReadOnly=False,bDefaultValueIsIgnored=False,bAdvancedView=False,\
         bOrphanedPin=False,)\n",
        0
    )
}
