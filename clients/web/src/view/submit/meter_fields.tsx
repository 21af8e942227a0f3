import { useEffect } from 'preact/hooks';
import { useStore } from '../../ui/store';
import { Field, NumberField, refusalsAt } from '../field';
import { change, form, outputs, refusals, type Output } from './form_model';
import { isLevel, workPlane, type LevelPlane } from './meter_model';
import { sceneDetails } from './scene_source';

const edges: [keyof LevelPlane, string][] = [
  ['left', 'Left, x in m'],
  ['right', 'Right, x in m'],
  ['back', 'Back, z in m'],
  ['front', 'Front, z in m'],
  ['height', 'Height, y in m'],
];

/** What the job makes, and the points at which it measures light. */
export function MeterFields() {
  const v = useStore(form);
  const details = useStore(sceneDetails);
  const bounds = details?.id === v.scene ? details.bounds : null;
  const measures = v.output !== 'image';
  useEffect(() => {
    const { plane, points } = form.get();
    if (measures && bounds && !plane && !points) change({ plane: workPlane(bounds) });
  }, [measures, bounds]);
  return (
    <>
      <Field
        label="Result"
        hint={measures && 'Illuminance in lux at points of the scene, with 95% intervals.'}
      >
        {(a) => (
          <select
            {...a}
            data-testid="output"
            value={v.output}
            onChange={(e) => {
              const output = e.currentTarget.value as Output;
              change({ output, ...(output === 'meter' && { useMeterError: true }) });
            }}
          >
            {Object.entries(outputs).map(([name, label]) => (
              <option key={name} value={name}>
                {label}
              </option>
            ))}
          </select>
        )}
      </Field>
      {measures && (
        <fieldset class="stop">
          <legend>Measured points</legend>
          <label class="check">
            <input
              type="checkbox"
              data-testid="meter-plane"
              checked={v.plane !== null}
              disabled={!v.plane && !bounds}
              onChange={(e) =>
                change({ plane: e.currentTarget.checked && bounds ? workPlane(bounds) : null })
              }
            />
            A grid on a plane
          </label>
          {v.plane && <PlaneFields />}
          <Field
            label="Single points"
            pointers={['/meter/points']}
            hint="One a line: x y z in m, facing up, or x y z and a normal."
          >
            {(a) => (
              <textarea
                {...a}
                rows={2}
                spellcheck={false}
                data-testid="meter-points"
                value={v.points}
                onInput={(e) => change({ points: e.currentTarget.value })}
              />
            )}
          </Field>
        </fieldset>
      )}
    </>
  );
}

function PlaneFields() {
  const plane = useStore(form).plane!;
  const { place } = plane;
  const field = (name: string, label: string, value: number, onValue: (v: number) => void) => (
    <NumberField
      key={name}
      label={label}
      data-testid={`meter-${name}`}
      value={value}
      step={label.endsWith(' m') ? 'any' : 1}
      onValue={onValue}
    />
  );
  const wrong = refusalsAt(useStore(refusals), ['/meter/plane']);
  return (
    <>
      {!isLevel(place) && (
        <p class="hint">The plane is tilted, turned or faces down, and is measured as it is.</p>
      )}
      {isLevel(place) && (
        <div class="pair">
          {edges.map(([edge, label]) =>
            field(edge, label, place[edge], (value) =>
              change({ plane: { ...plane, place: { ...place, [edge]: value } } }),
            ),
          )}
        </div>
      )}
      <div class="pair">
        {field('columns', 'Columns', plane.columns, (v) =>
          change({ plane: { ...plane, columns: Math.round(v) } }),
        )}
        {field('rows', 'Rows', plane.rows, (v) =>
          change({ plane: { ...plane, rows: Math.round(v) } }),
        )}
      </div>
      <p class="wrong" role={wrong.length ? 'alert' : undefined}>
        {wrong.map((w) => w.detail).join(' ')}
      </p>
    </>
  );
}
