import { useEffect, useRef, useState } from 'preact/hooks';
import type { Job } from 'tessera-render';
import { imageUrl } from '../../api/client';
import { ramps } from '../../live/heat';
import { readRadiance, type Luminances } from '../../live/radiance';
import { lumensPerWatt, luxScale, rampIndex, type LuxScale } from './lux';
import { sideMost, useRevision } from './server_image';

/** The layer's illuminances in lux, updated as the film grows. */
function useLux(job: Job, large: boolean): Luminances | 'missing' | null {
  const [lux, setLux] = useState<Luminances | 'missing' | null>(null);
  const revision = useRevision(job, large, 'irradiance');
  useEffect(() => {
    if (!revision) return;
    const abort = new AbortController();
    // Floats: the luminance of clipped or rounded channels would be wrong.
    const url = imageUrl(job.id, 'hdr', { layer: 'irradiance', revision, max_size: sideMost });
    fetch(url, { signal: abort.signal })
      .then(async (response) => {
        if (!response.ok) return setLux('missing');
        const found = readRadiance(new Uint8Array(await response.arrayBuffer()));
        setLux({ ...found, values: found.values.map((v) => v * lumensPerWatt) });
      })
      .catch(() => undefined); // Requested again at the next revision.
    return () => abort.abort();
  }, [job.id, revision]);
  return lux;
}

interface IrradianceImageProps {
  job: Job;
  large: boolean;
  onScale: (scale: LuxScale | null) => void;
}

/** The layer `irradiance` in false colours, by luminance. onScale: what the colours mean. */
export function IrradianceImage({ job, large, onScale }: IrradianceImageProps) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const lux = useLux(job, large);
  useEffect(() => {
    if (!lux || lux === 'missing' || !canvas.current) return;
    const { width, height, values } = lux;
    const scale = luxScale(values);
    const image = new ImageData(width, height);
    values.forEach((v, i) => {
      const at = 4 * rampIndex(v, scale);
      image.data.set(ramps.error.subarray(at, at + 4), 4 * i);
    });
    canvas.current.width = width;
    canvas.current.height = height;
    canvas.current.getContext('2d')!.putImageData(image, 0, 0);
    onScale(scale);
  }, [lux]);
  useEffect(() => () => onScale(null), []);
  if (lux === 'missing') return <p class="stage-note">This layer is not there yet.</p>;
  return (
    <canvas
      ref={canvas}
      class="server-image"
      data-layer={lux ? 'irradiance' : undefined}
      role="img"
      aria-label={`Illuminance in ${job.spec.scene}, in false colours`}
    />
  );
}
