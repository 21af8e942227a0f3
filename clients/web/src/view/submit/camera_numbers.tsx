import { NumberField, NumberInput } from '../field';
import { change, cropPixels, cropOf, type FormValues, type Pose } from './form_model';
import { poseOf, type Orbit } from './orbit';

const axes = ['x', 'y', 'z'] as const;

/** To tenths of a millimetre, the digits that a field shows. */
const short = (v: number): number => Number(v.toFixed(4));

const lengthOf = ({ position, target }: Pose): number =>
  Math.hypot(...position.map((v, i) => v - target[i]));

/** A pose, its lens and a crop entered as numbers. */
export function CameraNumbers({ values, orbit }: { values: FormValues; orbit: Orbit | null }) {
  const pose = values.pose ?? (orbit && poseOf(orbit));
  if (!pose) return null;
  const place = (part: 'position' | 'target', axis: number, value: number): void => {
    const next: Pose = { ...pose, [part]: pose[part].map((v, i) => (i === axis ? value : v)) };
    // A camera at its target has no direction.
    if (next.position.some((v, i) => v !== next.target[i])) change({ pose: next });
  };
  const { width, height } = values;
  const crop = cropPixels(values) ?? { x: 0, y: 0, width, height };
  return (
    <details class="advanced camera-numbers" data-testid="camera-numbers">
      <summary>Camera and crop by numbers</summary>
      <div class="advanced-body">
        {(['position', 'target'] as const).map((part) => (
          <fieldset key={part} class="triple">
            <legend>{part === 'position' ? 'Position (m)' : 'Look at (m)'}</legend>
            {axes.map((axis, i) => (
              <NumberInput
                key={axis}
                aria-label={`${part === 'position' ? 'Position' : 'Look at'} ${axis}, metres`}
                data-testid={`${part}-${axis}`}
                step="any"
                value={short(pose[part][i])}
                onValue={(value) => place(part, i, value)}
              />
            ))}
          </fieldset>
        ))}
        <NumberField
          label="Vertical field of view (°)"
          pointers={['/camera/vertical_fov_degrees']}
          data-testid="fov"
          min={1}
          max={179}
          step="any"
          value={short(pose.verticalFovDegrees)}
          onValue={(degrees) =>
            degrees > 0 &&
            degrees < 180 &&
            change({ pose: { ...pose, verticalFovDegrees: degrees } })
          }
        />
        <div class="pair">
          <NumberField
            label="Lens radius (mm)"
            pointers={['/camera/aperture_radius']}
            hint="Blurs what is out of focus; 0: everything is sharp."
            data-testid="aperture"
            min={0}
            step="any"
            value={values.apertureMm}
            onValue={(apertureMm) => change({ apertureMm })}
          />
          <NumberField
            label="Focus distance (m)"
            pointers={['/camera/focus_distance']}
            data-testid="focus"
            min={0}
            step="any"
            disabled={!(values.apertureMm > 0)}
            value={values.focusM ?? short(lengthOf(pose))}
            onValue={(focusM) => focusM > 0 && change({ focusM })}
          />
        </div>
        <fieldset class="triple triple-four">
          <legend>Crop (pixels)</legend>
          {(['x', 'y', 'width', 'height'] as const).map((member) => (
            <NumberInput
              key={member}
              aria-label={`Crop ${member}, pixels`}
              data-testid={`crop-${member}`}
              min={member === 'x' || member === 'y' ? 0 : 1}
              step={1}
              value={crop[member]}
              onValue={(value) =>
                change({ crop: cropOf({ ...crop, [member]: value }, width, height) })
              }
            />
          ))}
        </fieldset>
      </div>
    </details>
  );
}
