import { defineConfig } from 'vite';
import { markdownChapters } from './markdown';

declare const process: { env: Record<string, string | undefined> };

const upstream = process.env.TESSERA_SERVER ?? 'http://127.0.0.1:8090';

export default defineConfig({
  // Relative addresses: a proxy may place the page below a path.
  base: './',
  plugins: [markdownChapters()],
  resolve: { alias: { 'tessera-render': new URL('../js/src/index.ts', import.meta.url).pathname } },
  esbuild: { jsx: 'automatic', jsxImportSource: 'preact', legalComments: 'none' },
  // Files, never data: URLs, so that a strict Content-Security-Policy holds.
  build: {
    target: 'es2021',
    assetsInlineLimit: 0,
    // The second page is served as /embed/JOB, for frames in other pages.
    rollupOptions: { input: ['index.html', 'embed/index.html'] },
    modulePreload: { polyfill: false },
    reportCompressedSize: false,
  },
  worker: { format: 'es' },
  server: { fs: { allow: ['..'] }, proxy: { '/v1': upstream, '/openapi.json': upstream } },
});
