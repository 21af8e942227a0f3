"""Scenes made by code, in which Cycles and the add-on must agree: no soft lights, no volumes."""

import math

import bpy
import numpy as np

WIDTH, HEIGHT = 96, 64


def principled(made):
    return next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")


def lambert():
    """Gives Cycles the diffuse lobe of glTF: before Blender 4 that of Principled is Disney's."""
    for made in bpy.data.materials if bpy.app.version < (4,) else ():
        tree, shader = made.node_tree, principled(made)
        if shader.inputs["Metallic"].default_value == 0:
            diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
            diffuse.inputs["Color"].default_value = shader.inputs["Base Color"].default_value
            output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
            if shader.inputs["Emission Strength"].default_value <= 1:  # not one that glows
                tree.links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])


def material(name, color=(0.8, 0.8, 0.8), **inputs):
    """Principled BSDF without its dielectric layer, unless inputs name one."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = principled(made)
    shader.inputs["Base Color"].default_value = (*color, 1)
    shader.distribution = "MULTI_GGX"
    level = "Specular IOR Level" if "Specular IOR Level" in shader.inputs else "Specular"
    # Before Blender 4, a metal without it reflects no more at grazing angles.
    layer = 0.5 if inputs.get("Metallic") else 0.0
    for key, value in ({level: layer, "Roughness": 1.0} | inputs).items():
        shader.inputs[key].default_value = value
    return made


def show(mesh_operator, name, shown, **place):
    mesh_operator(**place)
    thing = bpy.context.object
    thing.name = name
    thing.data.materials.append(shown)
    return thing


def plane(name, shown, size=20.0, location=(0, 0, 0), rotation=(0, 0, 0)):
    return show(bpy.ops.mesh.primitive_plane_add, name, shown, size=size, location=location,
                rotation=rotation)


def cube(name, shown, size=1.5, location=(0, 0, 0.75), rotation=(0, 0, 0.5)):
    return show(bpy.ops.mesh.primitive_cube_add, name, shown, size=size, location=location,
                rotation=rotation)


def ball(name, shown, location, radius=0.8):
    thing = show(bpy.ops.mesh.primitive_uv_sphere_add, name, shown, radius=radius,
                 location=location, segments=64, ring_count=32)
    for polygon in thing.data.polygons:
        polygon.use_smooth = True
    return thing


def light(kind, energy, location=(0, 0, 0), rotation=(0, 0, 0), **members):
    data = bpy.data.lights.new(kind.lower(), kind)
    data.energy = energy
    if kind in ("POINT", "SPOT"):
        data.shadow_soft_size = 0
    if kind == "SUN":
        data.angle = 0
    for name, value in members.items():
        setattr(data, name, value)
    thing = bpy.data.objects.new(data.name, data)
    thing.location, thing.rotation_euler = location, rotation
    bpy.context.collection.objects.link(thing)
    return thing


def camera(location=(5, -5, 4), target=(0, 0, 0.5), **members):
    data = bpy.data.cameras.new("camera")
    for name, value in members.items():
        setattr(data, name, value)
    thing = bpy.data.objects.new("camera", data)
    thing.location = location
    import mathutils

    away = mathutils.Vector(target) - mathutils.Vector(location)
    thing.rotation_euler = away.to_track_quat("-Z", "Y").to_euler()
    bpy.context.collection.objects.link(thing)
    bpy.context.scene.camera = thing
    return thing


def world(color=(0, 0, 0), strength=1.0):
    made = bpy.data.worlds.new("world")
    bpy.context.scene.world = made
    made.use_nodes = True
    node = next(n for n in made.node_tree.nodes if n.type == "BACKGROUND")
    node.inputs["Color"].default_value = (*color, 1)
    node.inputs["Strength"].default_value = strength
    return made, node


def sky_image(is_float=True):
    """A smooth map whose four sides and both poles differ; of floats, brighter than 1 on one
    side, or of bytes in sRGB."""
    height, width = 64, 128
    v, u = np.mgrid[0:height, 0:width]
    around, up = 2 * math.pi * (u + 0.5) / width, math.pi * ((v + 0.5) / height - 0.5)
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., 0] = 0.5 + 0.4 * np.cos(around) * np.cos(up)
    pixels[..., 1] = 0.5 + 0.4 * np.sin(around) * np.cos(up)
    pixels[..., 2] = 1.0 + 0.9 * np.sin(up) + 2.0 * np.exp(-8 * (around - 2) ** 2) * np.cos(up)
    image = bpy.data.images.new("sky", width, height, float_buffer=is_float)
    if is_float:
        image.colorspace_settings.name = next(
            name for name in ("Linear Rec.709", "Linear")
            if name in image.colorspace_settings.bl_rna.properties["name"].enum_items)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    return image


def begin():
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = WIDTH, HEIGHT, 100
    world()


def one_cube():
    plane("floor", material("floor", (0.6, 0.5, 0.4)))
    cube("box", material("box", (0.2, 0.5, 0.8)))
    light("POINT", 300, (2, -3, 4))
    world((0.3, 0.4, 0.6), 0.5)
    camera()


def three_lights():
    plane("floor", material("floor"))
    cube("box", material("box", (0.8, 0.3, 0.2)))
    light("POINT", 200, (-2.5, -1.5, 2.5), color=(1, 0.5, 0.25))
    light("SPOT", 400, (2, -1, 5), (0.3, 0.2, 0), spot_size=0.7, spot_blend=0, color=(0.3, 1, 0.5))
    light("SUN", 0.7, rotation=(0.7, 0.4, 0), color=(0.6, 0.7, 1))
    camera()


def materials():
    plane("floor", material("floor", (0.5, 0.5, 0.5)))
    ball("metal", material("metal", (0.9, 0.6, 0.3), Metallic=1.0, Roughness=0.4), (-2, 0, 0.8))
    ball("matte", material("matte", (0.1, 0.4, 0.7)), (0, 0, 0.8))
    glow = material("glow", (0, 0, 0))
    shader = principled(glow)
    shader.inputs["Emission Color" if "Emission Color" in shader.inputs else "Emission"
                  ].default_value = (1, 0.4, 0.1, 1)
    shader.inputs["Emission Strength"].default_value = 4
    ball("glow", glow, (2, 0, 0.8))
    world((1, 1, 1), 0.5)
    camera((0, -8, 3), (0, 0, 0.6))


def hdri(is_float=True):
    plane("floor", material("floor"), size=6)
    ball("ball", material("ball", (0.7, 0.7, 0.7)), (0, 0, 1), 1)
    made, node = world((1, 1, 1), 0.8)
    tree = made.node_tree
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = sky_image(is_float)
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = (0, 0, math.radians(70))
    where = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(where.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], node.inputs["Color"])
    camera((4, -4, 2.5), (0, 0, 0.8), lens=24)


def world_of_bytes():
    hdri(is_float=False)


def shifted():
    """Shift, a sensor of its own, depth of field and a render region's worth of detail."""
    one_cube()
    lens = bpy.context.scene.camera.data
    lens.shift_x, lens.shift_y = 0.21, -0.13
    lens.sensor_width, lens.sensor_fit, lens.lens = 24, "HORIZONTAL", 28
    lens.dof.use_dof = True
    lens.dof.focus_distance, lens.dof.aperture_fstop = 6.5, 0.4


def panel():
    plane("floor", material("floor"))
    cube("box", material("box", (0.3, 0.7, 0.3)))
    light("AREA", 150, (-1, -1, 4), (0.2, -0.3, 0.4), shape="RECTANGLE", size=1.5, size_y=0.6)
    camera()


def orthographic():
    one_cube()
    lens = bpy.context.scene.camera.data
    lens.type, lens.ortho_scale, lens.shift_x = "ORTHO", 5, 0.1


def panorama():
    one_cube()
    thing = bpy.context.scene.camera
    thing.location, thing.data.type = (1.2, -2.2, 1.0), "PANO"
    owner = thing.data if hasattr(thing.data, "panorama_type") else thing.data.cycles
    owner.panorama_type = "EQUIRECTANGULAR"


SCENES = (one_cube, three_lights, materials, hdri, world_of_bytes, shifted, panel, orthographic,
          panorama)
