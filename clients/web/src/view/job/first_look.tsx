import { useEffect, useLayoutEffect, useState } from 'preact/hooks';
import type { Job } from 'tessera-render';
import { imageUrl } from '../../api/client';
import { filmOf, isAvailable } from '../../api/states';
import type { LiveFilm } from '../../live/film';
import type { JobFeed } from '../../live/job_feed';
import { display } from '../../ui/server_state';
import { thumbnailUrl } from '../jobs/thumbnail';

const tileSide = 32;

/**
 * The image that the page opens a job with. The server has it encoded at the job's end, with the
 * settings that display begins with (server/routes/first_images.cpp).
 */
export function firstLookUrl(job: Job): string {
  const { auto, exposure: stops, tone: tonemap } = display.get();
  const exposure = auto === false ? stops : 'auto';
  // JPEG is encoded in a quarter of WebP's time; WebP has alpha, with a tenth of PNG's bytes.
  const isOpaque = job.spec.background?.type !== 'transparent';
  return imageUrl(job.id, isOpaque ? 'jpg' : 'webp', { exposure, tonemap });
}

/**
 * The image encoded by the server, available with one small response; tiles are requested when it
 * is shown, replace it, and it is removed when all have arrived. Until it has arrived, the list's
 * thumbnail is shown, which the browser has. A job that has just started has neither.
 */
export function FirstLook({
  feed,
  job,
  film,
}: {
  feed: JobFeed;
  job: Job;
  film: LiveFilm | null;
}) {
  const [src] = useState(() =>
    isAvailable(job, 'image') && !film?.tilesSeen ? firstLookUrl(job) : '',
  );
  const { width, height, crop } = filmOf(job);
  const part = crop ?? { x: 0, y: 0, width, height };
  const last = (from: number, size: number): number =>
    Math.ceil((from + size) / tileSide) - Math.floor(from / tileSide);
  const tiles = last(part.x, part.width) * last(part.y, part.height);
  const [covered, setCovered] = useState(false);
  useEffect(() => film?.onChange(() => film.tilesSeen >= tiles && setCovered(true)), [film, tiles]);
  const wantTiles = (): void => feed.want('mean');
  useLayoutEffect(() => {
    if (!src) wantTiles();
  }, []);
  if (!src || covered) return null;
  const place = {
    left: `${(100 * part.x) / width}%`,
    top: `${(100 * part.y) / height}%`,
    width: `${(100 * part.width) / width}%`,
    height: `${(100 * part.height) / height}%`,
  };
  return (
    <>
      <img class="first-look" src={thumbnailUrl(job)} alt="" style={place} />
      <img
        class="first-look"
        data-testid="first-look"
        src={src}
        alt=""
        style={place}
        fetchpriority="high"
        onLoad={(e) => void e.currentTarget.decode().then(wantTiles, wantTiles)}
        onError={wantTiles}
      />
    </>
  );
}
