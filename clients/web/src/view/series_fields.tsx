import { useStore } from '../ui/store';
import { Field, NumberInput } from './field';
import { change, form } from './form_model';
import { sceneDetails } from './scene_source';

const viewsAtMost = 360;

/** Many pictures of one model: views around it, and all of its variants. */
export function SeriesFields() {
  const v = useStore(form);
  const variants = useStore(sceneDetails)?.variants ?? [];
  return (
    <details class="advanced" data-testid="series-fields">
      <summary>Series</summary>
      <div class="advanced-body">
        <Field
          label="Views around the model"
          pointers={['/matrix']}
          hint="A full turn in equal steps. A camera placed by hand keeps its height."
        >
          {(a) => (
            <NumberInput
              {...a}
              data-testid="views"
              value={v.views}
              min={1}
              max={viewsAtMost}
              step={1}
              onValue={(views) =>
                change({ views: Math.max(1, Math.min(viewsAtMost, Math.round(views))) })
              }
            />
          )}
        </Field>
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
      </div>
    </details>
  );
}
