
// A triangle that covers the atlas.
@vertex
fn vs_main(@builtin(vertex_index) corner: u32) -> @builtin(position) vec4f {
    return vec4f(f32(4u * (corner & 1u)) - 1.0, f32(2u * (corner & 2u)) - 1.0, 0.0, 1.0);
}

// A texel of one direction of a blur; one that holds nothing stays so.
@fragment
fn fs_main(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let size = vec2i(textureDimensions({source}));
    let here = vec2i(at.xy);
    let middle = textureLoad({source}, here, 0);
    if (middle.w == 0.0) {
        return vec4f(0.0);
    }
{reads}{before}    var sum = vec4f(0.0);
