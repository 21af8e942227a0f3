import type { Rect } from './film';
import { ramps, type Ramp } from './heat';
import { toBytes, toneGlsl, toneMaps, type ToneMap } from './tone';

/** Conversion of float values to display colours. */
export interface Look {
  kind: 'colour' | 'scalar';
  exposure: number;
  tone: ToneMap;
  /** Scalar values at the two ends of the ramp, on a logarithmic scale. */
  low: number;
  high: number;
  ramp: Ramp;
}

/** Shows values (RGBA floats, row by row; alpha 0: unknown). */
export interface Painter {
  readonly kind: 'webgl' | '2d';
  upload(rect: Rect, values: Float32Array, look: Look): void;
  /** Ends a batch of uploads. */
  draw(look: Look): void;
  /** True if a changed display setting needs every value again. */
  readonly bakesLook: boolean;
  dispose(): void;
}

export function makePainter(canvas: HTMLCanvasElement, onLost: () => void): Painter {
  const wish = readWish();
  if (wish === 'webgl' || (wish !== '2d' && hasGraphicsProcessor())) {
    const gl = canvas.getContext('webgl2', {
      alpha: true,
      antialias: false,
      depth: false,
      preserveDrawingBuffer: true,
      premultipliedAlpha: true,
    });
    const limit = gl ? (gl.getParameter(gl.MAX_TEXTURE_SIZE) as number) : 0;
    if (gl && Math.max(canvas.width, canvas.height) <= limit)
      return new GlPainter(canvas, gl, onLost);
  }
  return new CanvasPainter(canvas);
}

let graphicsProcessor: boolean | null = null;

/**
 * WebGL emulated on the CPU is many times slower than our own loop over the changed tiles: it
 * redraws the whole image each time and blocks the page. Browsers do not always report it when
 * asked to fail on a major performance caveat, but the renderer's name reveals it.
 */
export function hasGraphicsProcessor(): boolean {
  graphicsProcessor ??= ((): boolean => {
    const options: WebGLContextAttributes = { failIfMajorPerformanceCaveat: true };
    const canvas = document.createElement('canvas');
    const gl = canvas.getContext('webgl2', options) as WebGL2RenderingContext | null;
    if (!gl) return false;
    const names = gl.getExtension('WEBGL_debug_renderer_info');
    const name = String(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
    gl.getExtension('WEBGL_lose_context')?.loseContext();
    return !/swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
  })();
  return graphicsProcessor;
}

/** `localStorage["tessera.painter"]` selects one of the two, for tests and for faulty drivers. */
function readWish(): string | null {
  try {
    return localStorage.getItem('tessera.painter');
  } catch {
    return null;
  }
}

const scalarPosition = (value: number, look: Look): number =>
  Math.min(
    1,
    Math.max(0, Math.log(Math.max(value, 1e-30) / look.low) / Math.log(look.high / look.low)),
  );

class CanvasPainter implements Painter {
  readonly kind = '2d';
  readonly bakesLook = true;
  private readonly context: CanvasRenderingContext2D;

  constructor(canvas: HTMLCanvasElement) {
    this.context = canvas.getContext('2d', { willReadFrequently: true })!;
    // Browsers allocate a canvas's memory when it is first drawn and shown.
    this.context.clearRect(0, 0, 1, 1);
    this.context.getImageData(0, 0, 1, 1);
  }

  upload(rect: Rect, values: Float32Array, look: Look): void {
    const image = this.context.createImageData(rect.width, rect.height);
    const out = image.data;
    const scale = 2 ** look.exposure;
    const ramp = ramps[look.ramp];
    for (let i = 0; i < out.length; i += 4) {
      const alpha = values[i + 3];
      if (!(alpha > 0)) continue;
      if (look.kind === 'colour') {
        toBytes(
          values[i] / alpha,
          values[i + 1] / alpha,
          values[i + 2] / alpha,
          scale,
          look.tone,
          out,
          i,
        );
        out[i + 3] = 255 * alpha;
      } else {
        const k = 4 * Math.round(255 * scalarPosition(values[i], look));
        for (let c = 0; c < 4; ++c) out[i + c] = ramp[k + c];
      }
    }
    this.context.putImageData(image, rect.x, rect.y);
  }

  draw(): void {}
  dispose(): void {}
}

const vertexSource = `#version 300 es
void main() {
  vec2 p = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  gl_Position = vec4(p, 0.0, 1.0);
}`;

const fragmentSource = `#version 300 es
precision highp float;
uniform highp sampler2D film;
uniform sampler2D ramp;
uniform float scale;
uniform vec2 range;
uniform int tone;
uniform bool scalar;
out vec4 colour;
${toneGlsl}
void main() {
  ivec2 size = textureSize(film, 0);
  ivec2 at = ivec2(int(gl_FragCoord.x), size.y - 1 - int(gl_FragCoord.y));
  vec4 v = texelFetch(film, at, 0);
  if (!(v.a > 0.0)) { colour = vec4(0.0); return; }
  if (scalar) {
    float t = clamp(log(max(v.r, 1e-30) / range.x) / log(range.y / range.x), 0.0, 1.0);
    colour = vec4(texelFetch(ramp, ivec2(int(t * 255.0 + 0.5), 0), 0).rgb, 1.0);
  } else {
    colour = vec4(display(v.rgb / v.a * scale, tone) * v.a, v.a);
  }
}`;

class GlPainter implements Painter {
  readonly kind = 'webgl';
  readonly bakesLook = false;
  private program: WebGLProgram;
  private rampTextures = new Map<Ramp, WebGLTexture>();
  private uniforms: Record<string, WebGLUniformLocation | null> = {};
  private filmTexture: WebGLTexture;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly gl: WebGL2RenderingContext,
    onLost: () => void,
  ) {
    canvas.addEventListener('webglcontextlost', (e) => e.preventDefault());
    canvas.addEventListener('webglcontextrestored', onLost);
    this.program = this.link();
    for (const name of ['film', 'ramp', 'scale', 'range', 'tone', 'scalar'])
      this.uniforms[name] = gl.getUniformLocation(this.program, name);
    this.filmTexture = this.texture();
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, canvas.width, canvas.height);
    for (const ramp of Object.keys(ramps) as Ramp[]) {
      this.rampTextures.set(ramp, this.texture());
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, ramps[ramp]);
    }
  }

  private link(): WebGLProgram {
    const { gl } = this;
    const program = gl.createProgram();
    for (const [type, source] of [
      [gl.VERTEX_SHADER, vertexSource],
      [gl.FRAGMENT_SHADER, fragmentSource],
    ] as const) {
      const shader = gl.createShader(type)!;
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    return program;
  }

  private texture(): WebGLTexture {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
      gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    return texture;
  }

  upload(rect: Rect, values: Float32Array): void {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.filmTexture);
    gl.texSubImage2D(
      gl.TEXTURE_2D,
      0,
      rect.x,
      rect.y,
      rect.width,
      rect.height,
      gl.RGBA,
      gl.FLOAT,
      values,
    );
  }

  draw(look: Look): void {
    const { gl } = this;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.useProgram(this.program);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.filmTexture);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.rampTextures.get(look.ramp)!);
    gl.uniform1i(this.uniforms.film, 0);
    gl.uniform1i(this.uniforms.ramp, 1);
    gl.uniform1f(this.uniforms.scale, 2 ** look.exposure);
    gl.uniform2f(this.uniforms.range, look.low, look.high);
    gl.uniform1i(this.uniforms.tone, toneMaps.indexOf(look.tone));
    gl.uniform1i(this.uniforms.scalar, look.kind === 'scalar' ? 1 : 0);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  dispose(): void {
    // The canvas may keep its context; the film's texture uses the memory.
    this.gl.deleteTexture(this.filmTexture);
  }
}
