// Adds what lookups of a cube have gained to the texels that they read: the transpose of `sample_faces`
// (but that a place that is no number is clamped into the cube: here it says where to write).

struct Size {
    // Texels along a face, without the border.
    size: u32,
    samples: u32,
    // More than the base-2 logarithm of how many numbers a texel may get.
    headroom: i32,
    texels: u32,
}

@group(0) @binding(0) var<uniform> size: Size;
@group(0) @binding(1) var<storage, read_write> light_adjoint: array<f32>;
@group(0) @binding(2) var<storage, read_write> light_place: array<f32>;
@group(0) @binding(3) var<storage, read_write> largest: atomic<u32>;
@group(0) @binding(4) var<storage, read_write> sums: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> texels: array<f32>;

fn gained(s: u32) -> vec4f {
    return vec4f(light_adjoint[4u * s], light_adjoint[4u * s + 1u], light_adjoint[4u * s + 2u], light_adjoint[4u * s + 3u]);
}

// The largest number, by its bits: those of floats that are not negative are in the floats' order.
@compute @workgroup_size(64)
fn cs_largest(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let s = id.x + id.y * groups.x * 64u;
    if s >= size.samples {
        return;
    }
    let g = abs(gained(s));
    atomicMax(&largest, bitcast<u32>(max(max(g.x, g.y), max(g.z, g.w))));
}

// The four texels around a place, the first's index and the place's share of the others.
struct Footprint {
    first: u32,
    side: u32,
    f: vec2f,
}

fn footprint(s: u32) -> Footprint {
    let place = vec3f(light_place[3u * s], light_place[3u * s + 1u], light_place[3u * s + 2u]);
    let width = f32(size.size);
    let at = place.yz * width + 0.5;
    let low = clamp(floor(at), vec2f(0.0), vec2f(width));
    let side = size.size + 2u;
    let i = vec2u(low);
    return Footprint((u32(place.x) * side + i.y) * side + i.x, side, at - low);
}

fn weight(f: vec2f, corner: u32) -> f32 {
    let x = select(1.0 - f.x, f.x, (corner & 1u) == 1u);
    let y = select(1.0 - f.y, f.y, corner >= 2u);
    return x * y;
}

@compute @workgroup_size(64)
fn cs_exact(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let s = id.x + id.y * groups.x * 64u;
    if s >= size.samples {
        return;
    }
    let g = gained(s);
    if all(g == vec4f()) {
        return;
    }
    let at = footprint(s);
    let units = power_of_two(unit_exponent(size.headroom));
    for (var corner = 0u; corner < 4u; corner++) {
        let texel = at.first + (corner & 1u) + (corner >> 1u) * at.side;
        let share = weight(at.f, corner);
        for (var c = 0u; c < 4u; c++) {
            add_exactly(4u * texel + c, share * g[c], units);
        }
    }
}

@compute @workgroup_size(64)
fn cs_fast(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let s = id.x + id.y * groups.x * 64u;
    if s >= size.samples {
        return;
    }
    let g = gained(s);
    if all(g == vec4f()) {
        return;
    }
    let at = footprint(s);
    for (var corner = 0u; corner < 4u; corner++) {
        let texel = at.first + (corner & 1u) + (corner >> 1u) * at.side;
        let share = weight(at.f, corner);
        for (var c = 0u; c < 4u; c++) {
            add_fast(4u * texel + c, share * g[c]);
        }
    }
}

@compute @workgroup_size(64)
fn cs_exact_sums(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = id.x + id.y * groups.x * 64u;
    if i >= 4u * size.texels {
        return;
    }
    texels[i] = exact_sum(i, size.headroom);
}

@compute @workgroup_size(64)
fn cs_fast_sums(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = id.x + id.y * groups.x * 64u;
    if i >= 4u * size.texels {
        return;
    }
    texels[i] = fast_sum(i);
}
