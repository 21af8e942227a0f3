"""Mitsuba 3 through its Python package: its LLVM wavefront, or the mode in MITSUBA_MODE. `variant`
is the sampler: multijitter or independent."""

import math
import os

import drjit as dr
import gltf
import mitsuba as mi
import numpy as np

MODE = os.environ.get("MITSUBA_MODE", "llvm_ad_rgb")
mi.set_variant(MODE)

# Above, copies of a mesh become one mesh: compiling a kernel takes 1.1 CPU seconds with 250
# instances, 4.1 with 500, and more than three minutes and 7 GB with 10,000.
INSTANCES_MAX = 100


class Engine:
    def __init__(self, job):
        dr.set_thread_count(job["threads"])
        self.version = f"Mitsuba {mi.__version__} {MODE}, {job['variant']}"
        self.folder = job["folder"]
        self.source = gltf.read(job["scene"], reads_media=True)
        has_media = any(m.medium for m in self.source.materials)
        self.materials = [self.material(m) for m in self.source.materials]
        scene = {
            "type": "scene",
            # A path of one scattering event is Mitsuba's depth 2. Undocumented: roulette starts at
            # depth 5.
            "integrator": {"type": "path", "max_depth": job["depth"] + 1},
            "sensor": {
                "type": "perspective",
                "fov_axis": "y",
                "fov": math.degrees(self.source.vertical_fov),
                # Mitsuba's cameras look along +z.
                "to_world": mi.ScalarTransform4f(self.source.camera @ np.diag([-1.0, 1, -1, 1])),
                "near_clip": 1e-3,
                "far_clip": 1e5,
                "film": {
                    "type": "hdrfilm",
                    "width": job["width"],
                    "height": job["height"],
                    "pixel_format": "rgb",
                    "component_format": "float32",
                    "rfilter": {"type": "box"},
                },
                "sampler": {"type": job["variant"]},
            },
        }
        if has_media:
            # Its depth counts scatterings in media, the job's only those at surfaces: such jobs
            # must be so deep that no light remains there.
            #
            # volpath picks a distance by one channel without weighting it by those of the others,
            # so its noise grows exponentially with the difference between channels; its authors
            # recommend volpathmis. That loses light by Russian roulette: a ball of optical radius
            # 1.612 and an albedo of 0.9117 that scatters alike in all directions, under light of
            # radiance 1, has radiance 0.7841 at its centre by plain simulation, 0.7790(5) with its
            # roulette and 0.7846(7) without it.
            scene["integrator"] = {"type": "volpathmis", "max_depth": -1, "rr_depth": 1 << 30}
        if job["environment"]:
            # Row 0 at the top and the image's centre at +x: Mitsuba has its centre at +z.
            scene["environment"] = {"type": "envmap", "filename": job["environment"],
                                    "to_world": mi.ScalarTransform4f().rotate([0, 1, 0], 90)}
        elif job["sky"]:
            scene["environment"] = {
                "type": "constant",
                "radiance": {"type": "rgb", "value": job["sky"]},
            }
        for i, light in enumerate(self.source.lights):
            scene[f"light{i}"] = self.light(light)
        scene.update(self.shapes())
        self.description = scene
        self.scene = mi.load_dict(scene)

    def meter(self, points, samples, seed):
        """Irradiance (r, g, b) at points (position, normal): pi times the radiance that a white
        square of 1 mm reflects there, seen from 0.1 mm above. An irradiancemeter would not sample
        lights at the point itself."""
        out = []
        for position, normal in points:
            at, n = np.array(position, float), np.array(normal, float)
            up = [1, 0, 0] if abs(normal[0]) < 0.5 else [0, 1, 0]
            turn = mi.ScalarTransform4f().look_at(at.tolist(), (at + n).tolist(), up)
            scene = {name: part for name, part in self.description.items() if name != "sensor"}
            scene["square"] = {
                "type": "rectangle",
                "to_world": turn @ mi.ScalarTransform4f().scale(5e-4),
                "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [1, 1, 1]}},
            }
            scene["meter"] = {
                "type": "radiancemeter",
                "origin": (at + 1e-4 * n).tolist(),
                "direction": (-n).tolist(),
                "film": {"type": "hdrfilm", "width": 1, "height": 1, "pixel_format": "rgb",
                         "component_format": "float32", "rfilter": {"type": "box"}},
                "sampler": {"type": "independent"},
            }
            picture = np.array(mi.render(mi.load_dict(scene), spp=samples, seed=seed))
            out.append((math.pi * picture.mean(axis=(0, 1))).tolist())
        return out

    def render(self, samples, seed):
        picture = np.array(mi.render(self.scene, spp=samples, seed=seed))
        taken = self.scene.sensors()[0].sampler().sample_count()
        if taken != samples:
            raise ValueError(f"the sampler takes {taken} samples per pixel instead of {samples}")
        return picture

    def texture(self, image, color, channel=None, is_color=True):
        """An image multiplied by a colour; one channel of it as a scalar."""
        path = os.path.join(self.folder, f"image{image}")
        with open(path, "wb") as file:
            file.write(self.source.images[image])
        bitmap = mi.Bitmap(path)
        has_gamma = is_color and channel is None
        values = np.array(
            bitmap.convert(
                component_format=mi.Struct.Type.Float32,
                srgb_gamma=False,
                pixel_format=mi.Bitmap.PixelFormat.RGBA,
            )
            if has_gamma
            else bitmap.convert(
                mi.Bitmap.PixelFormat.RGBA, bitmap.component_format(), bitmap.srgb_gamma()
            )
        )
        if values.dtype != np.float32:
            values = values.astype(np.float32) / np.iinfo(values.dtype).max
        values = values[..., :3] if channel is None else values[..., channel:channel + 1]
        values = np.ascontiguousarray(values * np.asarray(color, np.float32))
        return {"type": "bitmap", "data": mi.TensorXf(values), "raw": True}

    def color(self, image, color):
        if image is None:
            return {"type": "rgb", "value": list(color)}
        return self.texture(image, color)

    def number(self, image, factor, channel):
        return factor if image is None else self.texture(image, [factor], channel)

    def material(self, m):
        base = self.color(m.base_color_texture, m.base_color)
        if m.transmission == 1 and m.metallic == 0 and m.ior == 1:
            return {"type": "null"}
        if m.transmission == 1 and m.metallic == 0:
            kind = {"type": "dielectric"} if m.roughness == 0 else {
                "type": "roughdielectric", "distribution": "ggx", "alpha": m.roughness ** 2}
            return {**kind, "int_ior": m.ior, "specular_transmittance": base}
        if m.is_lambertian and m.metallic_roughness_texture is None:
            bsdf = {"type": "diffuse", "reflectance": base}
        else:
            image = m.metallic_roughness_texture
            bsdf = {
                "type": "principled",
                "base_color": base,
                "metallic": self.number(image, m.metallic, 2),
                "roughness": self.number(image, m.roughness, 1),
                "spec_trans": float(m.transmission),
            }
            if m.ior == 1.5:
                bsdf["specular"] = 0.5 * m.specular
            else:
                bsdf["eta"] = m.ior
        if m.normal_texture is not None:
            if m.normal_scale != 1:
                raise gltf.Unsupported("a scale of the normal texture")
            bsdf = {"type": "normalmap", "bsdf": bsdf,
                    "normalmap": self.texture(m.normal_texture, [1, 1, 1], is_color=False)}
        if m.transmission == 0:
            bsdf = {"type": "twosided", "bsdf": bsdf}
        if m.alpha_mode != "OPAQUE":
            opacity = self.number(m.base_color_texture, m.alpha, 3)
            if m.alpha_mode == "MASK":
                if m.base_color_texture is None:
                    opacity = float(m.alpha >= m.alpha_cutoff)
                else:
                    values = np.array(opacity["data"]) >= m.alpha_cutoff
                    opacity["data"] = mi.TensorXf(values.astype(np.float32))
            bsdf = {"type": "mask", "bsdf": bsdf, "opacity": opacity}
        return bsdf

    def medium(self, medium):
        scale = max(medium.extinction)
        return {
            "type": "homogeneous",
            # Colours are within [0, 1].
            "sigma_t": {"type": "rgb", "value": [e / scale for e in medium.extinction]},
            "scale": scale,
            "albedo": {"type": "rgb", "value": list(medium.albedo)},
            "phase": {"type": "hg", "g": medium.g},
            # Connections from within a medium to area lights lose light: a ball of optical radius
            # 1.612 and an albedo of 0.9117 that scatters alike in all directions, in the box of
            # milk_in_box() (tests/render/mitsuba_check.py), gives an image of mean radiance
            # 0.5749(10) by plain simulation, 0.5637(7) with them and 0.5718(18) without.
            "sample_emitters": False,
        }

    def light(self, light):
        power = {"type": "rgb", "value": list(light.radiance)}
        # glTF's lights emit along -z, Mitsuba's along +z.
        matrix = mi.ScalarTransform4f(light.to_world @ np.diag([-1.0, 1, -1, 1]))
        if light.kind == "point":
            return {"type": "point", "position": light.to_world[:3, 3].tolist(), "intensity": power}
        if light.kind == "directional":
            return {
                "type": "directional",
                "direction": (-light.to_world[:3, 2]).tolist(),
                "irradiance": power,
            }
        return {
            "type": "spot",
            "intensity": power,
            "to_world": matrix,
            "cutoff_angle": math.degrees(light.outer),
            "beam_width": math.degrees(light.inner),
        }

    def shapes(self):
        """Meshes used once are in world space; those used several times become instances, unless
        they emit or are too many."""
        source, uses = self.source, {}
        for mesh, matrix in source.instances:
            uses.setdefault(mesh, []).append(matrix)
        bsdfs, out = [mi.load_dict(m) for m in self.materials], {}
        for mesh, matrices in uses.items():
            primitives = source.meshes[mesh]
            shining = any(source.materials[p.material].is_emissive for p in primitives)
            if len(matrices) == 1 or shining:
                for i, matrix in enumerate(matrices):
                    for k, primitive in enumerate(primitives):
                        out[f"mesh{mesh}_{i}_{k}"] = self.mesh(primitive, matrix, bsdfs)
                continue
            if len(matrices) > INSTANCES_MAX:
                for k, primitive in enumerate(primitives):
                    out[f"mesh{mesh}_{k}"] = self.mesh(
                        copies(primitive, matrices), np.eye(4), bsdfs
                    )
                continue
            group = {"type": "shapegroup"}
            for k, primitive in enumerate(primitives):
                group[f"part{k}"] = self.mesh(primitive, np.eye(4), bsdfs)
            out[f"group{mesh}"] = group
            for i, matrix in enumerate(matrices):
                out[f"mesh{mesh}_{i}"] = {
                    "type": "instance",
                    "group": {"type": "ref", "id": f"group{mesh}"},
                    "to_world": mi.ScalarTransform4f(matrix),
                }
        return out

    def mesh(self, primitive, matrix, bsdfs):
        material = self.source.materials[primitive.material]
        properties = mi.Properties()
        properties["bsdf"] = bsdfs[primitive.material]
        if material.is_emissive:
            properties["emitter"] = mi.load_dict(
                {
                    "type": "area",
                    "radiance": self.color(material.emissive_texture, material.emission),
                }
            )
        if material.medium is not None:
            properties["interior"] = mi.load_dict(self.medium(material.medium))
        positions = primitive.positions @ matrix[:3, :3].T + matrix[:3, 3]
        indices = primitive.indices
        if np.linalg.det(matrix[:3, :3]) < 0:
            indices = indices[:, ::-1]
        mesh = mi.Mesh(
            "mesh",
            len(positions),
            len(indices),
            properties,
            primitive.normals is not None,
            primitive.uv is not None,
        )
        values = mi.traverse(mesh)
        values["vertex_positions"] = np.ascontiguousarray(positions, np.float32).ravel()
        values["faces"] = np.ascontiguousarray(indices, np.uint32).ravel()
        if primitive.normals is not None:
            normals = primitive.normals @ np.linalg.inv(matrix[:3, :3])
            normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-20)
            values["vertex_normals"] = np.ascontiguousarray(normals, np.float32).ravel()
        if primitive.uv is not None:
            values["vertex_texcoords"] = np.ascontiguousarray(primitive.uv, np.float32).ravel()
        values.update()
        return mesh


def copies(primitive, matrices):
    """One primitive in world space with all copies."""
    count = len(primitive.positions)
    normals, uv = primitive.normals, primitive.uv
    if normals is not None:
        normals = np.concatenate([normals @ np.linalg.inv(m[:3, :3]) for m in matrices])
    return gltf.Primitive(
        positions=np.concatenate(
            [primitive.positions @ m[:3, :3].T + m[:3, 3] for m in matrices]
        ),
        normals=normals,
        uv=None if uv is None else np.tile(uv, (len(matrices), 1)),
        indices=np.concatenate(
            [
                (primitive.indices if np.linalg.det(m[:3, :3]) > 0 else primitive.indices[:, ::-1])
                + i * count
                for i, m in enumerate(matrices)
            ]
        ),
        material=primitive.material,
    )
