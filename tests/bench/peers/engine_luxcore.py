"""LuxCore through its Python package: PATHCPU or BIDIRCPU, with its Sobol sampler."""
import math
import os
import time

import gltf
import numpy as np
import pyluxcore

pyluxcore.Init(lambda message: None)


def write_ply(path, primitive):
    columns = {"x y z": primitive.positions, "nx ny nz": primitive.normals, "s t": primitive.uv}
    columns = {names: values for names, values in columns.items() if values is not None}
    head = "".join(f"property float {name}\n" for names in columns for name in names.split())
    faces = np.empty(len(primitive.indices), [("count", "u1"), ("corners", "<u4", 3)])
    faces["count"], faces["corners"] = 3, primitive.indices
    with open(path, "wb") as file:
        file.write(
            (
                "ply\nformat binary_little_endian 1.0\n"
                f"element vertex {len(primitive.positions)}\n{head}"
                f"element face {len(faces)}\nproperty list uchar uint vertex_indices\nend_header\n"
            ).encode()
        )
        file.write(np.concatenate(list(columns.values()), axis=1).astype("<f4").tobytes())
        file.write(faces.tobytes())


class Engine:
    def __init__(self, job):
        self.job = job
        self.renderer = "BIDIRCPU" if job["variant"] == "bidirectional" else "PATHCPU"
        self.version = f"LuxCore {pyluxcore.Version()} {self.renderer}, sobol"
        self.source = gltf.read(job["scene"], reads_media=True)
        self.scene = pyluxcore.Scene()
        self.camera()
        for i, material in enumerate(self.source.materials):
            self.material(f"m{i}", material)
        self.meshes()
        self.lights()

    def parse(self, **values):
        properties = pyluxcore.Properties()
        for name, value in values.items():
            value = value if isinstance(value, list) else [value]
            properties.Set(pyluxcore.Property(name.replace("__", "."), value))
        self.scene.Parse(properties)

    def set(self, prefix, values):
        self.parse(**{f"{prefix}.{name}": value for name, value in values.items()})

    def camera(self):
        matrix, fov = self.source.camera, self.source.vertical_fov
        width, height = self.job["width"], self.job["height"]
        eye, aspect, half = matrix[:3, 3], width / height, math.tan(fov / 2)
        # LuxCore's field of view is that of the shorter side. Its images are shifted down by one
        # row.
        right, top = max(aspect, 1.0), max(1 / aspect, 1.0)
        row = 2 * top / height
        values = {
            "type": "perspective",
            "lookat.orig": eye.tolist(),
            "lookat.target": (eye - matrix[:3, 2]).tolist(),
            "up": matrix[:3, 1].tolist(),
            "cliphither": 1e-3,
            "clipyon": 1e5,
            "autofocus.enable": 0,
            "lensradius": 0.0,
            "fieldofview": math.degrees(2 * math.atan(half * min(aspect, 1))),
            "screenwindow": [-right, right, -top - row, top - row],
        }
        self.set("scene.camera", values)

    def texture(self, name, image, factor, channel=None, gamma=1.0):
        """An image file multiplied by a factor."""
        path = os.path.join(self.job["folder"], f"lux{image}.png")
        with open(path, "wb") as file:
            file.write(self.source.images[image])
        values = {"type": "imagemap", "file": path, "gamma": gamma, "mapping.type": "uvmapping2d",
                  "mapping.uvscale": [1.0, 1.0]}
        if channel is not None:
            values["channel"] = channel
        self.set(f"scene.textures.{name}", values)
        if factor is None:
            return name
        self.set(f"scene.textures.{name}x", {"type": "scale", "texture1": name, "texture2": factor})
        return f"{name}x"

    def material(self, name, m):
        if m.alpha_mode != "OPAQUE":
            raise gltf.Unsupported("alpha, by this adapter")
        base = (list(m.base_color) if m.base_color_texture is None
                else self.texture(name + "b", m.base_color_texture, list(m.base_color), gamma=2.2))
        values = {"type": "disney", "basecolor": base}
        if m.medium is not None and (m.transmission < 1 or max(m.medium.albedo) > 0):
            raise gltf.Unsupported("scattering media, by this adapter")
        if m.transmission == 1:
            values = {"type": "glass", "kr": [1.0] * 3, "kt": base, "interiorior": m.ior}
            if m.roughness > 0:
                values.update(
                    {
                        "type": "roughglass",
                        "uroughness": m.roughness**2,
                        "vroughness": m.roughness**2,
                    }
                )
            if m.medium is not None:
                absorbing = {"type": "clear", "absorption": list(m.medium.extinction), "ior": m.ior}
                self.set(f"scene.volumes.{name}v", absorbing)
                values["volume.interior"] = f"{name}v"
        elif m.is_lambertian and m.metallic_roughness_texture is None:
            values = {"type": "matte", "kd": base}
        else:
            image = m.metallic_roughness_texture
            values["metallic"] = m.metallic if image is None else self.texture(
                name + "m", image, m.metallic, "blue")
            values["roughness"] = m.roughness if image is None else self.texture(
                name + "r", image, m.roughness, "green")
            # Disney's scale: F0 is 0.08 times the value.
            values["specular"] = m.specular * ((m.ior - 1) / (m.ior + 1)) ** 2 / 0.08
        if m.normal_texture is not None:
            bump = self.texture(name + "n", m.normal_texture, None)
            self.set(
                f"scene.textures.{name}nm",
                {"type": "normalmap", "texture": bump, "scale": m.normal_scale},
            )
            values["bumptex"] = f"{name}nm"
        if m.is_emissive:
            values["emission"] = (
                list(m.emission)
                if m.emissive_texture is None
                else self.texture(name + "e", m.emissive_texture, list(m.emission), gamma=2.2)
            )
        self.set(f"scene.materials.{name}", values)

    def meshes(self):
        for i, mesh in enumerate(self.source.meshes):
            for k, primitive in enumerate(mesh):
                path = os.path.join(self.job["folder"], f"s{i}_{k}.ply")
                write_ply(path, primitive)
                self.set(f"scene.shapes.s{i}_{k}", {"type": "mesh", "ply": path})
        for n, (mesh, matrix) in enumerate(self.source.instances):
            for k, p in enumerate(self.source.meshes[mesh]):
                self.set(f"scene.objects.o{n}_{k}", {
                    "shape": f"s{mesh}_{k}", "material": f"m{p.material}",
                    "transformation": [float(v) for v in matrix.T.ravel()]})

    def lights(self):
        if self.job["environment"]:
            # LuxCore's maps have z up, and are seen from outside.
            turn = np.array([[-1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
            self.set(
                "scene.lights.sky",
                {
                    "type": "infinite",
                    "file": self.job["environment"],
                    "gamma": 1.0,
                    "visibilitymapcache.enable": 0,
                    "transformation": [float(v) for v in turn.T.ravel()],
                },
            )
        elif self.job["sky"]:
            self.set(
                "scene.lights.sky", {"type": "constantinfinite", "color": list(self.job["sky"])}
            )
        for i, light in enumerate(self.source.lights):
            place, along = light.to_world[:3, 3], -light.to_world[:3, 2]
            values = {
                "point": {"type": "point", "position": place.tolist()},
                "directional": {"type": "sharpdistant", "direction": along.tolist()},
                "spot": {
                    "type": "spot",
                    "position": place.tolist(),
                    "target": (place + along).tolist(),
                    "coneangle": math.degrees(light.outer),
                    "conedeltaangle": math.degrees(light.outer - light.inner),
                },
            }[light.kind]
            self.set(f"scene.lights.l{i}", {**values, "color": list(light.radiance)})

    def render(self, samples, seed):
        job = self.job
        settings = {
            "renderengine.type": self.renderer, "renderengine.seed": seed + 1,
            "path.maxdepth": job["depth"], "light.maxdepth": job["depth"],
            "native.threads.count": job["threads"], "path.pathdepth.total": job["depth"],
            "path.pathdepth.diffuse": job["depth"], "path.pathdepth.glossy": job["depth"],
            "path.pathdepth.specular": job["depth"], "path.clamping.variance.maxvalue": 0.0,
            "path.hybridbackforward.enable": 0, "sampler.type": "SOBOL",
            "sampler.sobol.adaptive.strength": 0.0, "sampler.random.adaptive.strength": 0.0,
            "film.width": job["width"], "film.height": job["height"], "film.filter.type": "NONE",
            "film.imagepipelines.0.0.type": "NOP", "batch.haltspp": [samples, 0],
            "film.outputs.0.type": "RGB", "film.outputs.0.filename": "unused.exr"}
        if self.renderer == "BIDIRCPU":
            # Its roulette decides by one probability and weights strategies by another: the
            # weights of a path do not add up to 1 (a Cornell box is 5 to 8 % too bright).
            settings["path.russianroulette.cap"] = 1.0
        properties = pyluxcore.Properties()
        for name, value in settings.items():
            properties.Set(pyluxcore.Property(name, value if isinstance(value, list) else [value]))
        session = pyluxcore.RenderSession(pyluxcore.RenderConfig(properties, self.scene))
        session.Start()
        while not session.HasDone():
            time.sleep(0.005)
            session.UpdateStats()
        session.Stop()
        film, values = session.GetFilm(), np.empty((job["height"], job["width"], 3), np.float32)
        film.GetOutputFloat(pyluxcore.FilmOutputType.RGB, values, 0)
        return values[::-1]
