// A cube's texels from a tensor into the texture that shaders read.

@group(0) @binding(0) var<storage, read_write> texels: array<vec4f>;
@group(0) @binding(1) var faces: texture_storage_2d_array<rgba32float, write>;

@compute @workgroup_size(64)
fn cs_main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = id.x + id.y * groups.x * 64u;
    let side = textureDimensions(faces).x;
    if i >= 6u * side * side {
        return;
    }
    let face = i / (side * side);
    textureStore(faces, vec2u(i % side, i / side % side), face, texels[i]);
}
