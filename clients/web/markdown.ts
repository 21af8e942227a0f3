import { Marked, type TokenizerAndRendererExtension, type Tokens } from 'marked';
import type { Plugin } from 'vite';
import { mathBlock } from './math';

/** The anchor of a heading: its words in lower case, joined by hyphens. */
const slugOf = (text: string): string =>
  text
    .toLowerCase()
    .replace(/[^\p{L}\p{N}]+/gu, '-')
    .replace(/^-|-$/g, '');

/** n^2 and n^(−1/2), as in the laboratory's texts. */
const power: TokenizerAndRendererExtension = {
  name: 'power',
  level: 'inline',
  start: (text) => text.indexOf('^'),
  tokenizer(text) {
    const found = /^\^(?:\(([^)\n]*)\)|([\p{L}\p{N}]+))/u.exec(text);
    return found ? { type: 'power', raw: found[0], exponent: found[1] ?? found[2] } : undefined;
  },
  renderer: (token) => `<sup>${String(token.exponent)}</sup>`,
};

/** A button that submits two jobs and compares them, from `{"label": ..., "jobs": [a, b]}`. */
const pairButton = (source: string): string => {
  const { label, jobs } = JSON.parse(source) as { label: string; jobs: unknown[] };
  const data = JSON.stringify(jobs).replace(/&/g, '&amp;').replace(/"/g, '&quot;');
  const kind = 'type="button" class="quiet"';
  return `<p><button ${kind} data-pair="${data}">${label}</button></p>`;
};

/**
 * Chapters of the guide, compiled when the page is built: a module with the chapter's title, its
 * sections and its HTML in parts. `# ` is the title, each `## ` a section with an address. Blocks
 * of the language `math` are formulas, those of `pair` two jobs to compare. Content that may be
 * wider than a phone scrolls separately, also by keyboard.
 */
export function markdownChapters(): Plugin {
  return {
    name: 'markdown-chapters',
    transform(source, path) {
      if (!path.endsWith('.md')) return null;
      const chapter = path.replace(/^.*\/|\.md$/g, '');
      const sections: { id: string; title: string }[] = [];
      let title = '';
      const renderer = {
        code(token: Tokens.Code): string | false {
          if (token.lang === 'math') return mathBlock(token.text);
          return token.lang === 'pair' && pairButton(token.text);
        },
        heading(
          this: { parser: { parseInline(t: Tokens.Generic[]): string } },
          token: Tokens.Heading,
        ) {
          const inner = this.parser.parseInline(token.tokens);
          if (token.depth === 1) {
            title = token.text;
            return `<h1 tabindex="-1">${inner}</h1>`;
          }
          if (token.depth > 2) return `<h${token.depth}>${inner}</h${token.depth}>`;
          const id = slugOf(token.text);
          if (sections.some((s) => s.id === id)) throw new Error(`${path}: two sections "${id}"`);
          sections.push({ id, title: token.text.replace(/`/g, '') });
          const address = `#/guide/${chapter}/${id}`;
          return `<h2 id="${id}" tabindex="-1"><a href="${address}">${inner}</a></h2>`;
        },
      };
      const marked = new Marked({ gfm: true, renderer }, { extensions: [power] });
      const html = (marked.parse(source) as string)
        .replace(/<table>/g, '<div class="guide-table" tabindex="0"><table>')
        .replace(/<\/table>/g, '</table></div>')
        .replace(/<pre>/g, '<pre tabindex="0">');
      const parts = html.split(/(?=<h2 )/);
      return { code: `export default ${JSON.stringify({ title, sections, parts })};`, map: null };
    },
  };
}
