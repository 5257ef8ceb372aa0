//! What Unity keeps beside an asset, in a file of its name and `.meta`: who it is, and how it is imported.
//!
//! Materials and scenes name assets by their GUIDs alone (Unity's manual, "Asset metadata"), so one that a project has is kept. New
//! ones follow from names, so that the same export gives the same.
//!
//! Keys and numbers are those of the importers' scripting classes (Unity's scripting reference, `TextureImporter`,
//! `IHVImageFormatImporter`), in the form of Unity 2022.3. All that matters is spelt out: what a `.meta` leaves out is not what
//! Unity takes for a file without one.

use std::fmt;

use crate::model::texture_filter::TextureFilter;

/// An asset's identity: 32 hexadecimal digits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Guid(String);

impl Guid {
    const DIGITS: usize = 32;

    /// Of a file that belongs to a material. Two skins in one project differ by their materials' names.
    pub(super) fn of(material: &str, file: &str) -> Self {
        let hash = blake3::hash(format!("skinfit unity\n{material}\n{file}").as_bytes());
        Self(hash.to_hex()[..Self::DIGITS].to_owned())
    }

    /// That which a `.meta` has.
    pub(super) fn read(meta: &str) -> Option<Self> {
        let guid = meta.lines().find_map(|line| line.strip_prefix("guid:"))?.trim();
        let digits = guid.len() == Self::DIGITS && guid.chars().all(|c| c.is_ascii_hexdigit());
        digits.then(|| Self(guid.to_ascii_lowercase()))
    }
}

impl fmt::Display for Guid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// What imports an asset.
#[derive(Clone, Copy, Debug)]
pub(super) enum Importer {
    /// Of ShaderLab files.
    Shader,
    /// Of Unity's own files: here of a material.
    Material,
    /// Of pictures: a map, its colours decoded from sRGB or as they are stored.
    Map {
        /// Whether they are decoded.
        color: bool,
        /// How the scene filters maps.
        filter: TextureFilter,
    },
    /// Of pictures: a cube's faces in a column, +X -X +Y -Y +Z -Z from top to bottom.
    Faces,
    /// Of files that hold texels as a graphics card takes them: a cube as DDS.
    Cube,
}

impl Importer {
    /// The file for an asset of that identity.
    pub(super) fn meta(self, guid: &Guid) -> String {
        let body = match self {
            Self::Shader => SHADER.to_owned(),
            Self::Material => MATERIAL.to_owned(),
            Self::Cube => format!("{CUBE}{}", sampler(TextureFilter::Bilinear, "1")) + CUBE_REST,
            Self::Map { color, filter } => picture(color, filter, ["1", "6"], "0"),
            Self::Faces => picture(false, TextureFilter::Bilinear, ["2", "5"], "1"),
        };
        format!(
            "fileFormatVersion: 2\nguid: {guid}\n{body}  userData:\n  assetBundleName:\n  assetBundleVariant:\n"
        )
    }

    /// The lines without which the shader would read something else.
    pub(super) fn needed(self) -> &'static [&'static str] {
        match self {
            Self::Shader | Self::Material => &[],
            Self::Cube => &["sRGBTexture: 0"],
            Self::Faces => &["sRGBTexture: 0", "textureType: 0", "textureShape: 2", "generateCubemap: 5"],
            Self::Map { color: true, .. } => &["sRGBTexture: 1", "textureType: 0", "textureShape: 1"],
            Self::Map { .. } => &["sRGBTexture: 0", "textureType: 0", "textureShape: 1"],
        }
    }
}

/// How a texture is sampled where a shader does not say so by itself, as the exported one does. `wrap` 0 repeats, 1 clamps.
fn sampler(filter: TextureFilter, wrap: &str) -> String {
    let mode = if filter.reads_levels() { 2 } else { 1 };
    let taps = filter.most_taps();
    let lines = [
        "textureSettings:".to_owned(),
        "  serializedVersion: 2".to_owned(),
        format!("  filterMode: {mode}"),
        format!("  aniso: {taps}"),
        "  mipBias: 0".to_owned(),
        format!("  wrapU: {wrap}"),
        format!("  wrapV: {wrap}"),
        format!("  wrapW: {wrap}"),
    ];
    lines.iter().map(|line| format!("  {line}\n")).collect()
}

/// A picture, of that `shape` (a plane, or a cube laid out so): of the default type, as a normal map that Unity repacks has
/// other channels than the shader reads; of any size, uncompressed.
fn picture(color: bool, filter: TextureFilter, [shape, layout]: [&str; 2], wrap: &str) -> String {
    let (srgb, levels) = (u8::from(color), u8::from(filter.reads_levels()));
    PICTURE
        .replace("SRGB", &srgb.to_string())
        .replace("LEVELS", &levels.to_string())
        .replace("LAYOUT", layout)
        .replace("SHAPE", shape)
        .replace("SAMPLER\n", &sampler(filter, wrap))
}

const SHADER: &str = "ShaderImporter:
  externalObjects: {}
  defaultTextures: []
  nonModifiableTextures: []
  preprocessorOverride: 0
";

const MATERIAL: &str = "NativeFormatImporter:
  externalObjects: {}
  mainObjectFileID: 2100000
";

const CUBE: &str = "IHVImageFormatImporter:
  externalObjects: {}
";

const CUBE_REST: &str = "  isReadable: 0
  sRGBTexture: 0
  streamingMipmaps: 0
  streamingMipmapsPriority: 0
  ignoreMipmapLimit: 0
  mipmapLimitGroupName:
";

const PICTURE: &str = "TextureImporter:
  internalIDToNameTable: []
  externalObjects: {}
  serializedVersion: 12
  mipmaps:
    mipMapMode: 0
    enableMipMap: LEVELS
    sRGBTexture: SRGB
    linearTexture: 0
    fadeOut: 0
    borderMipMap: 0
    mipMapsPreserveCoverage: 0
    alphaTestReferenceValue: 0.5
    mipMapFadeDistanceStart: 1
    mipMapFadeDistanceEnd: 3
  bumpmap:
    convertToNormalMap: 0
    externalNormalMap: 0
    heightScale: 0.25
    normalMapFilter: 0
    flipGreenChannel: 0
  isReadable: 0
  streamingMipmaps: 0
  streamingMipmapsPriority: 0
  vTOnly: 0
  ignoreMipmapLimit: 0
  grayScaleToAlpha: 0
  generateCubemap: LAYOUT
  cubemapConvolution: 0
  seamlessCubemap: 0
  textureFormat: 1
  maxTextureSize: 16384
SAMPLER
  nPOTScale: 0
  lightmap: 0
  compressionQuality: 50
  spriteMode: 0
  alphaUsage: 1
  alphaIsTransparency: 0
  textureType: 0
  textureShape: SHAPE
  singleChannelComponent: 0
  flipbookRows: 1
  flipbookColumns: 1
  maxTextureSizeSet: 0
  compressionQualitySet: 0
  textureFormatSet: 0
  ignorePngGamma: 0
  applyGammaDecoding: 0
  swizzle: 50462976
  cookieLightType: 0
  platformSettings:
  - serializedVersion: 3
    buildTarget: DefaultTexturePlatform
    maxTextureSize: 16384
    resizeAlgorithm: 0
    textureFormat: -1
    textureCompression: 0
    compressionQuality: 50
    crunchedCompression: 0
    allowsAlphaSplitting: 0
    overridden: 0
    ignorePlatformSupport: 0
    androidETC2FallbackOverride: 0
    forceMaximumCompressionQuality_BC6H_BC7: 0
";
