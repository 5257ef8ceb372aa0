# Draws what job.json beside it asks for, in Godot 3: each of its shaders in each of its views, as half floats into
# SHADER_VIEW.bin.
extends SceneTree

func _init():
	var job = JSON.parse(content("res://job.json").get_string_from_utf8()).result
	var material = ShaderMaterial.new()
	for name in job.cubes:
		material.set_shader_param(name, cube(content("res://" + job.cubes[name])))
	for name in job.maps:
		material.set_shader_param(name, picture(content("res://" + job.maps[name])))
	var skin = MeshInstance.new()
	skin.mesh = surface(job.vertices, job.triangles)
	skin.material_override = material
	var camera = Camera.new()
	camera.near = 0.1
	var viewport = Viewport.new()
	viewport.size = Vector2(job.size, job.size)
	viewport.own_world = true
	# Linear half floats, the same way up as files.
	viewport.hdr = true
	viewport.keep_3d_linear = true
	viewport.render_target_v_flip = true
	viewport.transparent_bg = true
	viewport.render_target_update_mode = Viewport.UPDATE_ALWAYS
	viewport.add_child(skin)
	viewport.add_child(camera)
	root.add_child(viewport)
	for shader in job.shaders:
		material.shader = Shader.new()
		material.shader.code = job.shaders[shader]
		for view in job.views:
			camera.fov = job.views[view].fov
			camera.transform = placed(job.views[view].world_to_camera)
			yield(VisualServer, "frame_post_draw")
			var file = File.new()
			file.open("res://%s_%s.bin" % [shader, view], File.WRITE)
			file.store_buffer(viewport.get_texture().get_data().get_data())
			file.close()
	quit()

# An error above would leave the engine running.
func _idle(_delta):
	return OS.get_ticks_msec() > 240000

func content(path):
	var file = File.new()
	file.open(path, File.READ)
	var bytes = file.get_buffer(file.get_len())
	file.close()
	return bytes

# The six faces of a .dds of half floats, behind its 148 bytes of header: +X -X +Y -Y +Z -Z.
func cube(bytes):
	var size = bytes[16] + 256 * bytes[17]
	var sides = [
		CubeMap.SIDE_RIGHT, CubeMap.SIDE_LEFT, CubeMap.SIDE_TOP, CubeMap.SIDE_BOTTOM, CubeMap.SIDE_BACK, CubeMap.SIDE_FRONT
	]
	var texture = CubeMap.new()
	texture.flags = CubeMap.FLAG_FILTER
	for i in 6:
		var start = 148 + i * size * size * 8
		var face = Image.new()
		face.create_from_data(size, size, false, Image.FORMAT_RGBAH, bytes.subarray(start, start + size * size * 8 - 1))
		texture.set_side(sides[i], face)
	return texture

func picture(bytes):
	var image = Image.new()
	image.load_png_from_buffer(bytes)
	var texture = ImageTexture.new()
	texture.create_from_image(image, Texture.FLAG_FILTER | Texture.FLAG_REPEAT)
	return texture

# Of rows of position, normal, tangent with its sign, texture coordinates, occlusion.
func surface(vertices, triangles):
	var positions = PoolVector3Array()
	var normals = PoolVector3Array()
	var tangents = PoolRealArray()
	var uvs = PoolVector2Array()
	var occlusion = PoolVector2Array()
	for v in vertices:
		positions.append(Vector3(v[0], v[1], v[2]))
		normals.append(Vector3(v[3], v[4], v[5]))
		tangents.append_array(PoolRealArray([v[6], v[7], v[8], v[9]]))
		uvs.append(Vector2(v[10], v[11]))
		occlusion.append(Vector2(v[12], 0.0))
	var indices = PoolIntArray()
	for corners in triangles:
		# Godot's front faces are clockwise.
		indices.append_array(PoolIntArray([corners[0], corners[2], corners[1]]))
	var arrays = []
	arrays.resize(Mesh.ARRAY_MAX)
	arrays[Mesh.ARRAY_VERTEX] = positions
	arrays[Mesh.ARRAY_NORMAL] = normals
	arrays[Mesh.ARRAY_TANGENT] = tangents
	arrays[Mesh.ARRAY_TEX_UV] = uvs
	arrays[Mesh.ARRAY_TEX_UV2] = occlusion
	arrays[Mesh.ARRAY_INDEX] = indices
	var mesh = ArrayMesh.new()
	# Uncompressed: by itself it makes normals of bytes.
	mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays, [], 0)
	return mesh

# The camera's place, of the rows of a rigid motion from the world to it.
func placed(m):
	var to = Transform(
		Vector3(m[0], m[4], m[8]), Vector3(m[1], m[5], m[9]), Vector3(m[2], m[6], m[10]), Vector3(m[3], m[7], m[11])
	)
	return to.affine_inverse()
