import { useState } from 'preact/hooks';

const axes = ['x', 'y', 'z', 'w'];
const side = 260;

/** The first points of a sampler, in any two of its four dimensions. */
export function PatternPlot({ pattern, label }: { pattern: number[][]; label: string }) {
  const [pair, setPair] = useState<[number, number]>([0, 1]);
  const dimensions = pattern[0]?.length ?? 2;
  const pairs: [number, number][] = [];
  for (let a = 0; a < dimensions; ++a) for (let b = a + 1; b < dimensions; ++b) pairs.push([a, b]);
  const [a, b] = pair[1] < dimensions ? pair : [0, 1];
  const cells = Math.round(Math.sqrt(pattern.length));
  return (
    <figure class="lab-pattern">
      <svg
        viewBox={`-4 -4 ${side + 8} ${side + 8}`}
        role="img"
        aria-label={`${pattern.length} points of ${label}, axes ${axes[a]} and ${axes[b]}`}
        data-testid="lab-pattern"
      >
        {cells <= 32 &&
          Array.from({ length: cells + 1 }, (_, i) => (
            <path
              key={i}
              class="grid"
              d={`M0 ${(i * side) / cells}H${side}M${(i * side) / cells} 0V${side}`}
            />
          ))}
        <rect class="lab-frame" width={side} height={side} />
        {pattern.map((p, i) => (
          <circle
            key={i}
            class="lab-dot"
            cx={p[a] * side}
            cy={(1 - p[b]) * side}
            r={pattern.length > 300 ? 1.8 : 2.8}
          />
        ))}
      </svg>
      <figcaption class="hint">
        {pattern.length} points of {label}
      </figcaption>
      {pairs.length > 1 && (
        <div class="tiny-switch" role="group" aria-label="Axes shown">
          {pairs.map(([i, j]) => (
            <button
              key={`${i}${j}`}
              type="button"
              aria-pressed={i === a && j === b}
              onClick={() => setPair([i, j])}
            >
              {axes[i]}
              {axes[j]}
            </button>
          ))}
        </div>
      )}
    </figure>
  );
}
