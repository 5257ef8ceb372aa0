//! A writer of small glTF files: numbers of any kind into the binary chunk, shapes as primitives, and what a file lists.
//!
//! It checks nothing: whoever calls it says what glTF has to hold.

use serde_json::{Value, json};

use crate::scene_folder::glb;

/// A number that an accessor may hold.
pub(crate) trait Number: Copy {
    /// glTF's name of its type.
    const KIND: u32;

    fn put(self, to: &mut Vec<u8>);
}

macro_rules! numbers {
    ($($number:ty = $kind:expr),*) => {$(
        impl Number for $number {
            const KIND: u32 = $kind;

            fn put(self, to: &mut Vec<u8>) {
                to.extend(self.to_le_bytes());
            }
        }
    )*};
}

numbers!(i8 = 5120, u8 = 5121, i16 = 5122, u16 = 5123, f32 = 5126);

/// A glTF file that is being made.
pub(crate) struct File {
    pub(crate) json: Value,
    binary: Vec<u8>,
}

impl File {
    pub(crate) fn new() -> Self {
        let json = json!({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]});
        Self { json, binary: Vec::new() }
    }

    /// The bytes of the file.
    pub(crate) fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{"byteLength": self.binary.len()}]);
        glb(&json, &self.binary)
    }

    /// Put one more into a list of the file; its place there.
    pub(crate) fn add(&mut self, list: &str, one: Value) -> usize {
        if !self.json[list].is_array() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(one);
        list.len() - 1
    }

    /// A buffer view of bytes.
    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let start = self.binary.len();
        self.binary.extend(bytes);
        self.add("bufferViews", json!({"buffer": 0, "byteOffset": start, "byteLength": bytes.len()}))
    }

    /// An accessor of numbers. Rows of several begin at multiples of four bytes, as glTF asks of vertices.
    pub(crate) fn numbers<T: Number, const N: usize>(&mut self, rows: &[[T; N]]) -> usize {
        let (mut bytes, mut stride) = (Vec::new(), 0);
        for row in rows {
            let start = bytes.len();
            row.iter().for_each(|number| number.put(&mut bytes));
            if N > 1 {
                bytes.resize(bytes.len().next_multiple_of(4), 0);
            }
            stride = bytes.len() - start;
        }
        let view = self.view(&bytes);
        if N > 1 && stride != N * size_of::<T>() {
            self.json["bufferViews"][view]["byteStride"] = json!(stride);
        }
        let kind = match N {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        self.add(
            "accessors",
            json!({"bufferView": view, "componentType": T::KIND, "count": rows.len(), "type": kind}),
        )
    }

    /// The same of integers that stand for shares of their range.
    pub(crate) fn shares<T: Number, const N: usize>(&mut self, rows: &[[T; N]]) -> usize {
        let accessor = self.numbers(rows);
        self.json["accessors"][accessor]["normalized"] = json!(true);
        accessor
    }

    /// A texture of a picture within the file, with a sampler; its place.
    pub(crate) fn texture(&mut self, png: &[u8], sampler: Value) -> usize {
        let view = self.view(png);
        let image = self.add("images", json!({"bufferView": view, "mimeType": "image/png"}));
        let sampler = self.add("samplers", sampler);
        self.add("textures", json!({"source": image, "sampler": sampler}))
    }

    /// A material; its place.
    pub(crate) fn material(&mut self, material: Value) -> usize {
        self.add("materials", material)
    }

    /// A primitive of a shape.
    pub(crate) fn primitive(&mut self, shape: &Shape, material: usize) -> Value {
        let indices: Vec<[u16; 1]> = shape.triangles.as_flattened().iter().map(|&i| [i]).collect();
        json!({
            "attributes": {
                "POSITION": self.numbers(&shape.positions),
                "NORMAL": self.numbers(&shape.normals),
                "TEXCOORD_0": self.numbers(&shape.uvs),
            },
            "indices": self.numbers(&indices),
            "material": material,
        })
    }

    /// A node of the scene; its place.
    pub(crate) fn root(&mut self, node: Value) -> usize {
        let place = self.add("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(place));
        place
    }

    /// A mesh of primitives.
    pub(crate) fn mesh(&mut self, name: &str, primitives: &[Value]) -> usize {
        self.add("meshes", json!({"name": name, "primitives": primitives}))
    }

    /// A mesh of one shape at a place of the world; its node.
    pub(crate) fn put(&mut self, shape: &Shape, material: usize, at: [f64; 3]) -> usize {
        let primitive = self.primitive(shape, material);
        let mesh = self.mesh("shape", &[primitive]);
        self.root(json!({"mesh": mesh, "translation": at}))
    }

    /// A square of white skin, 2 wide, half a unit behind the middle.
    pub(crate) fn backdrop(&mut self) {
        let skin = self.material(json!({"name": "Skin"}));
        self.put(&Shape::panel(1.0, 1.0), skin, [0.0, 0.0, -0.5]);
    }
}

/// Triangles with normals and texture coordinates.
#[derive(Clone, Default)]
pub(crate) struct Shape {
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) normals: Vec<[f32; 3]>,
    pub(crate) uvs: Vec<[f32; 2]>,
    pub(crate) triangles: Vec<[u16; 3]>,
}

impl Shape {
    /// A rectangle that faces +Z, by half its width and height.
    pub(crate) fn panel(x: f32, y: f32) -> Self {
        Self {
            positions: vec![[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]],
            normals: vec![[0.0, 0.0, 1.0]; 4],
            uvs: vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        }
    }

    /// The sides of a box by half its size: +Z, -Z, +X, -X, +Y, -Y.
    pub(crate) fn sides(half: [f32; 3]) -> [Self; 6] {
        // Of each side what is outwards, and what is right and up on it.
        [
            ([0., 0., 1.], [1., 0., 0.], [0., 1., 0.]),
            ([0., 0., -1.], [-1., 0., 0.], [0., 1., 0.]),
            ([1., 0., 0.], [0., 0., -1.], [0., 1., 0.]),
            ([-1., 0., 0.], [0., 0., 1.], [0., 1., 0.]),
            ([0., 1., 0.], [1., 0., 0.], [0., 0., -1.]),
            ([0., -1., 0.], [1., 0., 0.], [0., 0., 1.]),
        ]
        .map(|(out, right, up): ([f32; 3], [f32; 3], [f32; 3])| {
            let flat = Self::panel(1.0, 1.0);
            let corner =
                |[x, y, _]: [f32; 3]| std::array::from_fn(|c| half[c] * (out[c] + x * right[c] + y * up[c]));
            let positions = flat.positions.iter().copied().map(corner).collect();
            Self { positions, normals: vec![out; 4], ..flat }
        })
    }

    /// A whole box by half its size.
    pub(crate) fn cuboid(half: [f32; 3]) -> Self {
        let mut whole = Self::default();
        for side in Self::sides(half) {
            let base = whole.positions.len() as u16;
            whole.positions.extend(side.positions);
            whole.normals.extend(side.normals);
            whole.uvs.extend(side.uvs);
            whole.triangles.extend(side.triangles.iter().map(|triangle| triangle.map(|i| base + i)));
        }
        whole
    }
}
