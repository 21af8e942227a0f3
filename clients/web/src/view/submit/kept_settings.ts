// What this browser keeps of earlier forms.
import { persistent } from '../../ui/store';
import { change, type FormValues } from './form_model';
import { stopRules } from './stop_rules';

/** An environment map that this browser has sent. */
export interface Panorama {
  asset: string;
  name: string;
}
const isPanoramas = (v: unknown): v is Panorama[] =>
  Array.isArray(v) && v.every((m) => typeof m?.asset === 'string' && typeof m?.name === 'string');

/** Newest first. */
export const panoramas = persistent<Panorama[]>('tessera.panoramas', [], isPanoramas);

/** Settings of a look that can be kept for other models: not the model, its camera or the name. */
const presetMembers: (keyof FormValues)[] = [
  'width',
  'height',
  ...stopRules.filter(({ of }) => of !== 'meter').flatMap(({ use, value }) => [use, value]),
  'environment',
  'environmentAsset',
  'environmentName',
  'environmentColour',
  'environmentIntensity',
  'environmentRotation',
  'sunLatitude',
  'sunLongitude',
  'sunTime',
  'background',
  'backgroundColour',
  'ground',
  'groundReflection',
  'shadow',
  'shadowStrength',
  'shadowSoftness',
  'throughGlass',
  'views',
  'allVariants',
  'integrator',
  'maxDepth',
  'filter',
];

export type LookPreset = Partial<FormValues>;

const isPresets = (v: unknown): v is Record<string, LookPreset> =>
  typeof v === 'object' && v !== null && !Array.isArray(v);

/** Presets by name, kept in this browser. */
export const lookPresets = persistent<Record<string, LookPreset>>('tessera.presets', {}, isPresets);

export const presetOf = (v: FormValues): LookPreset =>
  Object.fromEntries(presetMembers.map((member) => [member, v[member]]));

/** Members that an older page did not store keep their values. */
export const applyPreset = (preset: LookPreset): void =>
  change(
    Object.fromEntries(
      presetMembers.flatMap((m) => (preset[m] === undefined ? [] : [[m, preset[m]]])),
    ) as Partial<FormValues>,
  );
