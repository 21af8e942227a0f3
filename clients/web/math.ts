/**
 * Formulas of the guide: a small part of LaTeX, compiled to MathML when the page is built. Letters,
 * numbers, `_`, `^`, `{...}`, \frac, \sqrt, \hat, \bar, \text, functions, Greek letters and the
 * operators below; anything else ends the build.
 */
const letters: Record<string, string> = {
  alpha: 'α',
  gamma: 'γ',
  theta: 'θ',
  lambda: 'λ',
  mu: 'μ',
  pi: 'π',
  rho: 'ρ',
  sigma: 'σ',
  phi: 'φ',
  omega: 'ω',
  Phi: 'Φ',
  Delta: 'Δ',
  infty: '∞',
};
const operators: Record<string, string> = {
  int: '∫',
  sum: '∑',
  prod: '∏',
  cdot: '·',
  le: '≤',
  ge: '≥',
  ne: '≠',
  to: '→',
  approx: '≈',
  sim: '∼',
  propto: '∝',
  partial: '∂',
  nabla: '∇',
  Rightarrow: '⇒',
};
const functions = new Set(['sin', 'cos', 'ln', 'exp', 'min', 'max']);
const tokens = /\\text\{[^}]*\}|\\[a-zA-Z]+|\d+(?:\.\d+)?|\S/gu;

const escaped = (text: string): string =>
  text.replace(/&/g, '&amp;').replace(/</g, '&lt;').replace(/>/g, '&gt;');
const element = (name: string, ...parts: string[]): string =>
  `<${name}>${parts.join('')}</${name}>`;

class Formula {
  private readonly tokens: string[];
  private at = 0;
  constructor(private readonly source: string) {
    this.tokens = source.match(tokens) ?? [];
  }

  /** Everything up to the end or a closing brace. */
  row(): string {
    const parts: string[] = [];
    while (this.at < this.tokens.length && this.tokens[this.at] !== '}') parts.push(this.term());
    return element('mrow', ...parts);
  }
  /** An atom with its indices. */
  private term(): string {
    const base = this.atom();
    const marks: Record<string, string> = {};
    while (this.tokens[this.at] === '_' || this.tokens[this.at] === '^')
      marks[this.tokens[this.at++]] = this.atom();
    const above = /^<mo>[∑∏]/.test(base);
    const { _: low, '^': high } = marks;
    if (low && high) return element(above ? 'munderover' : 'msubsup', base, low, high);
    if (low) return element(above ? 'munder' : 'msub', base, low);
    return high ? element(above ? 'mover' : 'msup', base, high) : base;
  }
  private atom(): string {
    const token = this.tokens[this.at++];
    if (token === undefined || token === '}') throw new Error(`incomplete formula: ${this.source}`);
    if (token === '{') {
      const inner = this.row();
      if (this.tokens[this.at++] !== '}') throw new Error(`no closing brace: ${this.source}`);
      return inner;
    }
    // Outer spaces of mtext are dropped unless they do not break.
    if (token.startsWith('\\text{'))
      return element('mtext', escaped(token.slice(6, -1)).replace(/^ | $/g, '\u00a0'));
    if (/^\d/.test(token)) return element('mn', token);
    if (/^\p{L}/u.test(token)) return element('mi', token);
    if (/^[()[\]|]$/.test(token)) return `<mo stretchy="false">${token}</mo>`;
    if (!token.startsWith('\\')) return element('mo', escaped(token === '-' ? '−' : token));
    const name = token.slice(1);
    if (name === 'frac') return element('mfrac', this.atom(), this.atom());
    if (name === 'sqrt') return element('msqrt', this.atom());
    if (name === 'hat') return element('mover', this.atom(), element('mo', '^'));
    if (name === 'bar') return element('mover', this.atom(), element('mo', '¯'));
    if (name === 'quad') return '<mspace width="1.5em"></mspace>';
    if (functions.has(name)) return element('mi', name) + element('mo', '&#x2061;');
    if (letters[name]) return element('mi', letters[name]);
    if (operators[name]) return element('mo', operators[name]);
    throw new Error(`unknown ${token} in ${this.source}`);
  }
  isAtEnd(): boolean {
    return this.at === this.tokens.length;
  }
}

/** One display formula for each line. */
export function mathBlock(source: string): string {
  const lines = source.split('\n').filter((line) => line.trim());
  const formulas = lines.map((line) => {
    const formula = new Formula(line);
    const row = formula.row();
    if (!formula.isAtEnd()) throw new Error(`a brace too many: ${line}`);
    return `<math display="block">${row}</math>`;
  });
  const name = 'role="group" aria-label="Formulas" tabindex="0"';
  return `<div class="guide-math" ${name}>${formulas.join('')}</div>`;
}
