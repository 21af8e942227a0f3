// A synthetic scene with a known expected value and noise level per pixel, so that the page can be
// developed without a renderer: every image converges to `truth` as 1/sqrt(samples).

const mix = (a, b, t) => a + (b - a) * t;
const clamp01 = (v) => Math.min(1, Math.max(0, v));

/** Cheap standard normal from an integer state; quality does not matter here. */
export function makeNormal(seed) {
  let s = (seed * 2654435761 + 88172645463325252) >>> 0 || 1;
  const next = () => {
    s ^= s << 13;
    s >>>= 0;
    s ^= s >>> 17;
    s ^= s << 5;
    s >>>= 0;
    return s / 4294967296;
  };
  return () => (next() + next() + next() + next() - 2) * 1.7320508;
}

const spheres = [
  { x: -0.95, y: 0.62, z: 0.3, r: 0.62, c: [0.92, 0.74, 0.36], rough: 0.25 },
  { x: 0.35, y: 0.45, z: 0.75, r: 0.45, c: [0.2, 0.42, 0.82], rough: 0.5 },
  { x: 1.35, y: 0.8, z: -0.3, r: 0.8, c: [0.85, 0.83, 0.8], rough: 0.08 },
  { x: -0.1, y: 0.24, z: 1.5, r: 0.24, c: [0.78, 0.3, 0.22], rough: 0.4 },
];

function hitSphere(o, d) {
  let best = null;
  for (const s of spheres) {
    const ox = o[0] - s.x,
      oy = o[1] - s.y,
      oz = o[2] - s.z;
    const b = ox * d[0] + oy * d[1] + oz * d[2];
    const disc = b * b - (ox * ox + oy * oy + oz * oz - s.r * s.r);
    if (disc <= 0) continue;
    const t = -b - Math.sqrt(disc);
    if (t > 1e-3 && (!best || t < best.t)) best = { t, s };
  }
  return best;
}

function sky(d, warm) {
  const t = clamp01(0.5 + 0.5 * d[1]);
  const sun = Math.pow(Math.max(0, d[0] * 0.55 + d[1] * 0.62 + d[2] * 0.56), 60) * 6;
  return [
    mix(0.6, 0.22, t) + sun + warm,
    mix(0.62, 0.36, t) + sun * 0.85 + warm * 0.6,
    mix(0.66, 0.62, t) + sun * 0.6,
  ];
}

/** Mean radiance, noise level, albedo, normal and depth of one camera ray. */
function shade(o, d, depth, warm) {
  const hit = hitSphere(o, d);
  const tFloor = d[1] < 0 ? -o[1] / d[1] : Infinity;
  if (!hit && tFloor === Infinity) {
    return { c: sky(d, warm), sigma: 0.02, albedo: [0, 0, 0], n: [0, 0, 0], z: Infinity };
  }
  const floor = !hit || tFloor < hit.t;
  const t = floor ? tFloor : hit.t;
  const p = [o[0] + d[0] * t, o[1] + d[1] * t, o[2] + d[2] * t];
  const n = floor
    ? [0, 1, 0]
    : [(p[0] - hit.s.x) / hit.s.r, (p[1] - hit.s.y) / hit.s.r, (p[2] - hit.s.z) / hit.s.r];
  const checker = (Math.floor(p[0] * 1.5) + Math.floor(p[2] * 1.5)) & 1;
  const albedo = floor ? (checker ? [0.62, 0.6, 0.57] : [0.3, 0.3, 0.31]) : hit.s.c;
  const l = [0.55, 0.62, 0.56];
  let shadow = 1;
  for (const s of spheres) {
    if (!floor && s === hit.s) continue;
    const ox = p[0] - s.x,
      oy = p[1] - s.y,
      oz = p[2] - s.z;
    const b = ox * l[0] + oy * l[1] + oz * l[2];
    const near = Math.sqrt(Math.max(0, ox * ox + oy * oy + oz * oz - b * b)) / s.r;
    if (b < 0) shadow = Math.min(shadow, clamp01((near - 0.7) / 0.6));
  }
  let occlusion = 1;
  for (const s of spheres) {
    const dx = p[0] - s.x,
      dy = p[1] - s.y,
      dz = p[2] - s.z;
    const gap = Math.sqrt(dx * dx + dy * dy + dz * dz) / s.r;
    if (floor) occlusion *= clamp01(0.25 + 0.75 * (gap - 0.9));
  }
  const cos = Math.max(0, n[0] * l[0] + n[1] * l[1] + n[2] * l[2]);
  const ambient = 0.35 * occlusion * (0.6 + 0.4 * n[1]);
  const c = albedo.map((a, i) => 0.6 * a * (ambient + 1.7 * cos * shadow * [1, 0.93, 0.82][i]));
  if (!floor && depth < 2) {
    const k = 2 * (d[0] * n[0] + d[1] * n[1] + d[2] * n[2]);
    const r = [d[0] - k * n[0], d[1] - k * n[1], d[2] - k * n[2]];
    const fresnel = mix(
      0.05 + (1 - hit.s.rough) * 0.35,
      1,
      Math.pow(1 + (d[0] * n[0] + d[1] * n[1] + d[2] * n[2]), 5),
    );
    const refl = shade(
      [p[0] + n[0] * 1e-3, p[1] + n[1] * 1e-3, p[2] + n[2] * 1e-3],
      r,
      depth + 1,
      warm,
    );
    for (let i = 0; i < 3; ++i) c[i] += fresnel * (1 - hit.s.rough * 0.7) * refl.c[i];
  }
  const penumbra = 4 * shadow * (1 - shadow);
  return {
    c,
    sigma: 0.18 + 0.9 * penumbra + 0.45 * (1 - occlusion) + (floor ? 0 : 0.2),
    albedo,
    n,
    z: t,
  };
}

/**
 * camera: {position, target, fov} or null. Fills the planes of a range of rows; called row by row
 * so as not to block.
 */
export function makeTruth(width, height, camera, warm = 0) {
  const film = {
    mean: new Float32Array(width * height * 3),
    sigma: new Float32Array(width * height),
    albedo: new Float32Array(width * height * 3),
    normal: new Float32Array(width * height * 3),
    depth: new Float32Array(width * height),
  };
  const eye = camera?.position ?? [0.4, 1.7, 5.2];
  const at = camera?.target ?? [0.1, 0.55, 0];
  const f = [at[0] - eye[0], at[1] - eye[1], at[2] - eye[2]];
  const fl = Math.hypot(...f);
  f.forEach((_, i) => (f[i] /= fl));
  const rx = [-f[2], 0, f[0]];
  const rl = Math.hypot(...rx) || 1;
  rx.forEach((_, i) => (rx[i] /= rl));
  const up = [
    rx[1] * f[2] - rx[2] * f[1],
    rx[2] * f[0] - rx[0] * f[2],
    rx[0] * f[1] - rx[1] * f[0],
  ];
  const k = Math.tan(((camera?.fov ?? 38) * Math.PI) / 360);
  for (let y = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x) {
      const u = ((2 * (x + 0.5)) / width - 1) * k * (width / height),
        v = (1 - (2 * (y + 0.5)) / height) * k;
      const d = [
        f[0] + rx[0] * u + up[0] * v,
        f[1] + rx[1] * u + up[1] * v,
        f[2] + rx[2] * u + up[2] * v,
      ];
      const dl = Math.hypot(...d);
      d.forEach((_, i) => (d[i] /= dl));
      const s = shade(eye, d, 0, warm);
      const i = y * width + x;
      film.sigma[i] = s.sigma;
      film.depth[i] = s.z;
      for (let c = 0; c < 3; ++c) {
        film.mean[3 * i + c] = s.c[c];
        film.albedo[3 * i + c] = s.albedo[c];
        film.normal[3 * i + c] = s.n[c];
      }
    }
  }
  return film;
}
