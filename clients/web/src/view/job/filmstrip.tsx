import { useGrowing } from '../../ui/later';
import { jobs } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { sceneTitle, shortState, stateLabel } from '../jobs/job_words';
import { Thumbnail } from '../jobs/thumbnail';

const atOnce = 6;

/** Arrow keys move between the links of a strip, of which one can be reached by Tab. */
function move(event: KeyboardEvent): void {
  const step = { ArrowRight: 1, ArrowLeft: -1, Home: -Infinity, End: Infinity }[event.key];
  if (step === undefined) return;
  const links = [...(event.currentTarget as HTMLElement).querySelectorAll('a')];
  const at = links.indexOf(event.target as HTMLAnchorElement);
  event.preventDefault();
  links[Math.max(0, Math.min(links.length - 1, at + step))].focus();
}

/** The newest jobs as a strip below the image. */
export function Filmstrip({ current }: { current: string | null }) {
  const list = useStore(jobs);
  const drawn = useGrowing(Math.min(24, list?.length ?? 0), atOnce);
  if (!list?.length) return null;
  const shown = list.slice(0, Math.min(24, drawn));
  const stop = shown.some((job) => job.id === current) ? current : shown[0]?.id;
  return (
    <nav class="filmstrip" aria-label="Renders">
      <ol onKeyDown={move}>
        {shown.map((job) => (
          <li key={job.id}>
            <a
              href={`#/jobs/${job.id}`}
              tabIndex={job.id === stop ? 0 : -1}
              aria-current={job.id === current ? 'page' : undefined}
              title={`${sceneTitle(job)}, ${stateLabel(job)}`}
            >
              <Thumbnail job={job} />
              <span class="strip-name">{sceneTitle(job)}</span>
              <span class={`strip-state state-text-${job.state}`}>{shortState(job)}</span>
            </a>
          </li>
        ))}
      </ol>
      {list.length > 5 && (
        <a class="strip-all" href="#/jobs">
          All renders
        </a>
      )}
    </nav>
  );
}
