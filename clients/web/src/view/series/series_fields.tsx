import { useStore } from '../../ui/store';
import { Field, NumberField } from '../field';
import { change, form } from '../submit/form_model';
import { isAnimated, sceneDetails } from '../submit/scene_source';

const viewsAtMost = 360;
const framesAtMost = 1000;

const whole = (value: number, most: number): number =>
  Math.max(1, Math.min(most, Math.round(value)));

/** Many images of one model: views around it, all of its variants, frames of its animation. */
export function SeriesFields() {
  const v = useStore(form);
  const scene = useStore(sceneDetails);
  const variants = scene?.variants ?? [];
  return (
    <details class="advanced" data-testid="series-fields">
      <summary>Series</summary>
      <div class="advanced-body">
        <NumberField
          label="Views around the model"
          pointers={['/matrix']}
          hint="One full turn in equal steps, at the height and distance of your view."
          data-testid="views"
          value={v.views}
          min={1}
          max={viewsAtMost}
          step={1}
          onValue={(views) => change({ views: whole(views, viewsAtMost) })}
        />
        {variants.length > 1 && (
          <label class="check">
            <input
              type="checkbox"
              data-testid="all-variants"
              checked={v.allVariants}
              onChange={(e) => change({ allVariants: e.currentTarget.checked })}
            />
            All {variants.length} variants
          </label>
        )}
        {v.environment === 'sun' && (
          <Field
            label="Times of the day"
            hint="From the time of the sun above until midnight; the hours of the night are dark."
          >
            {(a) => (
              <select
                {...a}
                data-testid="day-minutes"
                value={v.dayMinutes}
                onChange={(e) => change({ dayMinutes: Number(e.currentTarget.value) })}
              >
                <option value={0}>One</option>
                <option value={30}>Every half hour</option>
                <option value={60}>Every hour</option>
                <option value={120}>Every two hours</option>
              </select>
            )}
          </Field>
        )}
        {isAnimated(scene) && (
          <div class="pair">
            <NumberField
              label="Animation frames"
              data-testid="frames"
              value={v.frames}
              min={1}
              max={framesAtMost}
              step={1}
              onValue={(frames) => change({ frames: whole(frames, framesAtMost) })}
            />
            <NumberField
              label="Frames per second"
              data-testid="frames-per-second"
              value={v.framesPerSecond}
              min={1}
              step="any"
              onValue={(framesPerSecond) => framesPerSecond > 0 && change({ framesPerSecond })}
            />
          </div>
        )}
      </div>
    </details>
  );
}
