
// A workgroup blurs 64 texels along the axis, in four lines side by side. These and 32 to either side stand in memory
// that its threads share, line by line; two numbers more a line let lines begin in different banks.
const ALONG = 64;
const BESIDE = 32;
const STAGED = 128u;
const LINE = 130;
var<workgroup> staged: array<vec4f, 520>;
// A thread's texel: how far along from the workgroup's first, and in which line.
var<private> own: vec2i;

// The first texel of each workgroup, its column in the low half and its row in the high one.
@group(1) @binding(0) var<storage, read> tiles: array<u32>;
@group(1) @binding(1) var left_0_level: texture_storage_2d<rgba32float, write>;

// A texel; outside the atlas nothing.
fn texel_at(place: vec2i) -> vec4f {
    let size = vec2i(textureDimensions({source}));
    let inside = all(place >= vec2i(0)) && all(place < size);
    return select(vec4f(0.0), textureLoad({source}, clamp(place, vec2i(0), size - 1), 0), inside);
}

// One that is so far along the axis.
fn texel_near(here: vec2i, step: i32) -> vec4f {
    let along = own.x + step;
    if (along >= -BESIDE && along < ALONG + BESIDE) {
        return staged[LINE * own.y + BESIDE + along];
    }
    return texel_at(here + step * {axis});
}

// A texel of one direction of a blur; one that holds nothing stays so.
@compute @workgroup_size(256)
fn cs_texels(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let tile = workgroup.x + workgroups.x * workgroup.y;
    let packed = tiles[min(tile, arrayLength(&tiles) - 1u)];
    let first = vec2i(i32(packed & 0xffffu), i32(packed >> 16u));
    for (var k = thread; k < 4u * STAGED; k += 256u) {
        let at = {staged};
        staged[LINE * at.y + at.x] = texel_at(first + (at.x - BESIDE) * {axis} + at.y * {across});
    }
    workgroupBarrier();
    own = {own};
    let here = first + own.x * {axis} + own.y * {across};
    let middle = texel_near(here, 0);
    if (tile < arrayLength(&tiles) && middle.w != 0.0) {
        textureStore(left_0_level, here, blurred(here, middle));
    }
}

fn blurred(here: vec2i, middle: vec4f) -> vec4f {
    let size = vec2i(textureDimensions({source}));
{reads}{before}    var sum = vec4f(0.0);
