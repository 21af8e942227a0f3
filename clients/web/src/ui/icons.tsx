/** Line icons on a 20 px grid; always next to text or in a labelled button. */
const paths = {
  plus: 'M10 4v12M4 10h12',
  pause: 'M7 4.5v11M13 4.5v11',
  play: 'M6.5 4.5v11l9-5.5z',
  stop: 'M5.5 5.5h9v9h-9z',
  download: 'M10 3.5v9m-3.5-3.5L10 12.5 13.5 9M4 16.5h12',
  more: 'M5 10h.01M10 10h.01M15 10h.01',
  trash: 'M4.5 6h11M8 6V4h4v2m-6 0 .7 10h6.6L14 6',
  again: 'M15.5 10a5.5 5.5 0 1 1-1.7-4M14 2.8V6h-3.2',
  upload: 'M10 13V4M6.5 7.5 10 4l3.5 3.5M4 16.5h12',
  fit: 'M4 7.5V4h3.5M16 7.5V4h-3.5M4 12.5V16h3.5M16 12.5V16h-3.5',
  sun:
    'M10 6.5a3.5 3.5 0 1 0 0 7 3.5 3.5 0 0 0 0-7zM10 2v1.5M10 16.5V18M2 10h1.5M16.5 10H18' +
    'M4.3 4.3l1.1 1.1M14.6 14.6l1.1 1.1M4.3 15.7l1.1-1.1M14.6 5.4l1.1-1.1',
  moon: 'M16 11.5A6.5 6.5 0 1 1 8.5 4a5.2 5.2 0 0 0 7.5 7.5z',
  auto: 'M10 3a7 7 0 1 0 0 14 7 7 0 0 0 0-14zm0 0v14',
  orbit:
    'M10 12.5a2.5 2.5 0 1 0 0-5 2.5 2.5 0 0 0 0 5zM3 12c0-2.5 3-4.5 7-4.5s7 2 7 4.5-3 3.5-7 3.5',
  compare: 'M10 3v14M3.5 5.5h4v9h-4zM12.5 5.5h4v9h-4z',
  gear: 'M4 6h7m4 0h1M4 14h1m4 0h7M13 4v4M7 12v4',
  close: 'M5 5l10 10M15 5 5 15',
  link: 'M8.5 11.5l3-3M7 9 5 11a2.8 2.8 0 0 0 4 4l2-2M9 7l2-2a2.8 2.8 0 0 1 4 4l-2 2',
} as const;

export type IconName = keyof typeof paths;

export function Icon({ name }: { name: IconName }) {
  return (
    <svg
      class="icon"
      viewBox="0 0 20 20"
      width="20"
      height="20"
      aria-hidden="true"
      focusable="false"
    >
      <path
        d={paths[name]}
        fill="none"
        stroke="currentColor"
        stroke-width="1.6"
        stroke-linecap="round"
        stroke-linejoin="round"
      />
    </svg>
  );
}
