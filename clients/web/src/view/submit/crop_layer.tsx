import { useRef } from 'preact/hooks';
import { change, cropOf, cropPixels, type FormValues } from './form_model';

interface Corner {
  x: number;
  y: number;
}

const between = (v: number, high: number): number => Math.max(0, Math.min(high, Math.round(v)));

/**
 * The crop over the preview, in pixels of the image. drawing: the pointer draws a new one;
 * otherwise it moves the camera.
 */
export function CropLayer({ values, drawing }: { values: FormValues; drawing: boolean }) {
  const svg = useRef<SVGSVGElement>(null);
  /** Position of the pointer when pressed. Moves may happen before the next redraw. */
  const from = useRef<Corner | null>(null);
  const { width, height } = values;
  const at = (e: PointerEvent): Corner => {
    const point = new DOMPoint(e.clientX, e.clientY).matrixTransform(
      svg.current!.getScreenCTM()!.inverse(),
    );
    return { x: between(point.x, width), y: between(point.y, height) };
  };
  const draw = (e: PointerEvent): void => {
    if (!from.current) return;
    e.stopPropagation();
    const { x, y } = from.current;
    const to = at(e);
    const rect = {
      x: Math.min(x, to.x),
      y: Math.min(y, to.y),
      width: Math.abs(to.x - x),
      height: Math.abs(to.y - y),
    };
    change({ crop: rect.width && rect.height ? cropOf(rect, width, height) : null });
  };
  const crop = cropPixels(values);
  if (!crop && !drawing) return null;
  const whole = `M0 0H${width}V${height}H0Z`;
  return (
    <svg
      ref={svg}
      class={`crop-layer${drawing ? ' crop-drawing' : ''}`}
      data-testid="crop-layer"
      viewBox={`0 0 ${width} ${height}`}
      aria-hidden="true"
      onPointerDown={(e) => {
        if (!drawing) return;
        e.stopPropagation();
        svg.current!.setPointerCapture(e.pointerId);
        from.current = at(e);
      }}
      onPointerMove={draw}
      onPointerUp={(e) => {
        draw(e);
        from.current = null;
      }}
    >
      {crop && (
        <>
          <path
            class="crop-veil"
            fill-rule="evenodd"
            d={`${whole}M${crop.x} ${crop.y}h${crop.width}v${crop.height}h${-crop.width}Z`}
          />
          <rect class="crop-edge" {...crop} vector-effect="non-scaling-stroke" />
        </>
      )}
    </svg>
  );
}
