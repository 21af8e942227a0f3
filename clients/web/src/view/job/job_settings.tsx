import { useState } from 'preact/hooks';
import type { Job, Server } from 'tessera-render';
import { api } from '../../api/client';
import { say, serverInfo } from '../../ui/server_state';
import { useStore } from '../../ui/store';
import { formOf } from '../submit/form_of_job';
import { change, formRequest, refusals, type FormValues } from '../submit/form_model';
import { poseOnOrbit } from '../submit/orbit';
import { sceneName } from '../submit/scene_source';
import { linesOf, requestFor, textKinds, textOf, type TextKind } from '../submit/request_texts';

/** The settings of a render: to read, to use again, to export. */
export function JobSettings({ job }: { job: Job }) {
  const info = useStore(serverInfo);
  const request = requestFor(job, info);
  return (
    <section class="card" aria-labelledby="settings-title" data-testid="settings">
      <header class="card-head">
        <h2 id="settings-title">Settings</h2>
        <button
          type="button"
          class="quiet small"
          data-testid="use-again"
          onClick={() => void reuse(job, info)}
        >
          Use again
        </button>
      </header>
      <dl class="figures settings-list">
        {linesOf(request).map(([name, value]) => (
          <div key={name} title={value}>
            <dt>{name.replace(/[._]/g, ' ')}</dt>
            <dd class="mono">{name === 'scene' ? sceneName(value) : value}</dd>
          </div>
        ))}
      </dl>
      <Elsewhere request={request} />
    </section>
  );
}

/** Fills in the form with the settings of a job, and then with `other` ones. */
export async function reuse(
  job: Job,
  info: Server | null,
  other: Partial<FormValues> = {},
): Promise<void> {
  refusals.set([]);
  const values = formOf(job, info);
  if (job.spec.camera.orbit) {
    // The form has no orbits: the pose depends on the size of the scene.
    const scene = await api.scene(job.spec.scene).catch(() => null);
    if (scene) values.pose = poseOnOrbit(job.spec, scene.bounds);
  }
  const request = requestFor(job, info);
  const stop = request.stop as { deadline?: string };
  // A deadline that has passed would end the new render before it begins.
  if (stop.deadline && Date.parse(stop.deadline) < Date.now()) delete stop.deadline;
  change({ ...values, ...other, reused: { request, form: formRequest(values, info?.options) } });
  say(`The form has the settings of this render${Object.keys(other).length ? ', changed' : ''}.`);
  // On a phone the form is below the image.
  if (matchMedia('(max-width: 799px)').matches)
    document.getElementById('new')?.scrollIntoView({ block: 'start' });
}

function Elsewhere({ request }: { request: Record<string, unknown> }) {
  const [kind, setKind] = useState<TextKind>('json');
  const text = textOf(kind, request, location.origin);
  const copy = async (): Promise<void> => {
    // Over plain HTTP browsers deny access to the clipboard; the text can be selected.
    const copied = await navigator.clipboard?.writeText(text).then(
      () => true,
      () => false,
    );
    say(copied ? 'Copied.' : 'This browser does not let the page copy: select the text.');
  };
  return (
    <details class="advanced">
      <summary>The same render elsewhere</summary>
      <div class="advanced-body">
        <div class="settings-copy">
          <select
            aria-label="Written for"
            data-testid="text-kind"
            value={kind}
            onChange={(e) => setKind(e.currentTarget.value as TextKind)}
          >
            {(Object.keys(textKinds) as TextKind[]).map((k) => (
              <option key={k} value={k}>
                {textKinds[k]}
              </option>
            ))}
          </select>
          <button type="button" class="quiet" onClick={() => void copy()}>
            Copy
          </button>
        </div>
        <pre class="settings-text" tabIndex={0} aria-label={textKinds[kind]} data-testid="text">
          {text}
        </pre>
      </div>
    </details>
  );
}
