// Shows the server's OpenAPI document: operations, which can be tried, schemas and problem types.

/** The theme that the main page has stored; otherwise that of the system. */
const stored = localStorage.getItem('tessera.theme')?.replaceAll('"', '');
if (stored === 'dark' || stored === 'light') document.documentElement.dataset.theme = stored;

const openapi = await (await fetch('openapi.json')).json();
const { schemas } = openapi.components;
const byId = (id) => document.getElementById(id);

/** An element with properties or attributes. */
function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties))
    if (name in element) element[name] = value;
    else element.setAttribute(name, value);
  element.append(...children.flat());
  return element;
}

/** Text with `code`. */
const prose = (text = '') =>
  text.split('`').map((part, i) => (i % 2 === 1 ? make('code', {}, part) : part));

const resolved = (node) =>
  node?.$ref
    ? node.$ref
        .slice(2)
        .split('/')
        .reduce((place, part) => place[part], openapi)
    : node;

const joined = (parts, between) =>
  parts.flatMap((part, i) => (i === 0 ? part : [between, ...part]));

/** The type of a value: text, and links to schemas. */
function typeOf(schema = {}) {
  if (schema.$ref) {
    const name = schema.$ref.split('/').at(-1);
    return [make('a', { href: `#schema-${name}` }, name)];
  }
  if (schema.anyOf) return joined(schema.anyOf.map(typeOf), ' or ');
  if (schema.enum)
    return joined(
      schema.enum.map((value) => [make('code', {}, JSON.stringify(value))]),
      ', ',
    );
  if (schema.format === 'binary') return ['bytes'];
  const kinds = [schema.type ?? 'any'].flat().flatMap((kind) => {
    if (kind === 'array') return ['list of ', ...typeOf(schema.items)];
    if (kind === 'object' && schema.additionalProperties)
      return ['map of ', ...typeOf(schema.additionalProperties)];
    return [kind];
  });
  const limits = [
    'minimum',
    'exclusiveMinimum',
    'maximum',
    'exclusiveMaximum',
    'minLength',
    'maxLength',
    'minItems',
    'maxItems',
    'pattern',
  ];
  const words = limits
    .filter((limit) => limit in schema)
    .map((limit) => `${limit.replace(/[A-Z]/g, (c) => ` ${c.toLowerCase()}`)} ${schema[limit]}`);
  if (schema.format === 'date-time') words.unshift('RFC 3339');
  return [
    ...joined(
      kinds.map((kind) => [kind]),
      ' ',
    ),
    words.length ? ` (${words.join(', ')})` : '',
  ];
}

const row = (name, marks, type, doc) => [
  make('dt', {}, make('code', {}, name), ' ', marks && make('em', {}, `${marks} `), ...type),
  make('dd', {}, ...prose(doc)),
];

/** Calls `fill` when the details are opened for the first time. */
function lazy(details, fill) {
  const filled = () => {
    details.removeEventListener('toggle', filled);
    details.append(...fill());
  };
  details.addEventListener('toggle', filled);
  return details;
}

function schemaDetails([name, schema]) {
  const summary = make('summary', {}, make('code', {}, name));
  return lazy(make('details', { id: `schema-${name}` }, summary), () => {
    const members = Object.entries(schema.properties ?? {}).flatMap(([member, inner]) =>
      row(
        member,
        schema.required?.includes(member) ? 'required' : '',
        typeOf(inner),
        inner.description,
      ),
    );
    const example = schema.examples?.[0];
    return [
      make('p', {}, ...prose(schema.description)),
      members.length ? make('dl', {}, ...members) : make('p', {}, ...typeOf(schema)),
      ...(example ? [block(`Example of ${name}`, JSON.stringify(example, null, 2))] : []),
    ];
  });
}

/** Code that scrolls, and is therefore reachable by keyboard. */
function block(label, text) {
  return make('pre', { tabIndex: 0, role: 'region', 'aria-label': label }, text);
}

const content = (content = {}) =>
  Object.entries(content).map(([media, { schema }]) =>
    make('p', {}, make('code', {}, media), ' ', ...typeOf(schema)),
  );

function fieldOf({ name, schema, required, in: place, description }) {
  const choices = schema.type === 'boolean' ? ['true', 'false'] : schema.enum;
  const id = (fieldOf.count = (fieldOf.count ?? 0) + 1);
  const field = choices
    ? make(
        'select',
        {},
        ...['', ...choices].map((value) => make('option', { value }, value || '–')),
      )
    : make('input', { placeholder: String(schema.default ?? '') });
  field.id = `field-${id}`;
  field.required = required;
  field.parameter = { name, place };
  const label = make('label', { htmlFor: field.id }, make('code', {}, name));
  const type = [` ${place}${required ? ', required' : ''}: `, ...typeOf(schema)];
  return make(
    'div',
    { className: 'field' },
    make('div', {}, label, ...type),
    field,
    make('p', {}, ...prose(description)),
  );
}

/** The fields of a body: media type, and its text or file. */
function bodyFields(requestBody) {
  const medias = Object.keys(requestBody.content);
  const media = make('select', { name: 'media' }, ...medias.map((m) => make('option', {}, m)));
  const text = make('textarea', { name: 'text', rows: 10, spellcheck: false });
  const file = make('input', { name: 'file', type: 'file' });
  const textLabel = make('label', {}, 'Body', text);
  const fileLabel = make('label', {}, 'File', file);
  const show = () => {
    const { schema } = requestBody.content[media.value];
    const isJson = /json$/.test(media.value) && schema.format !== 'binary';
    textLabel.hidden = !isJson;
    fileLabel.hidden = isJson;
    text.value = JSON.stringify(resolved(schema).examples?.[0] ?? {}, null, 2);
  };
  media.addEventListener('change', show);
  show();
  return [make('label', {}, 'Type of the body', media), textLabel, fileLabel];
}

/** Shows an answer as it comes; a stream until it is stopped. */
async function showAnswer(output, request) {
  const asked = `the response to ${request.method} ${new URL(request.url).pathname}`;
  const status = make('p', { role: 'status' }, 'Waiting for the answer');
  output.replaceChildren(status);
  try {
    const response = await fetch(request);
    status.textContent = `${response.status} ${response.statusText}`;
    const headers = [...response.headers].map(([name, value]) => `${name}: ${value}`).join('\n');
    output.append(block(`Headers of ${asked}`, headers));
    const type = response.headers.get('content-type') ?? '';
    if (/^image\/(png|jpeg|webp|avif)/.test(type)) {
      const src = URL.createObjectURL(await response.blob());
      output.append(make('img', { src, alt: 'The image of the response' }));
      return;
    }
    const body = block(`Body of ${asked}`, '');
    output.append(body);
    if (/json$/.test(type.split(';')[0])) {
      body.textContent = JSON.stringify(await response.json(), null, 2);
    } else if (/^text|ndjson/.test(type)) {
      const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
      for (let part = await reader.read(); !part.done; part = await reader.read())
        body.append(part.value);
    } else {
      const { size } = await response.blob();
      body.textContent = `${size} bytes`;
    }
  } catch (error) {
    output.append(make('p', {}, error.name === 'AbortError' ? 'Stopped.' : String(error)));
  }
}

function tryForm(path, method, operation) {
  const output = make('div', { className: 'answer' });
  const stop = make('button', { type: 'button', className: 'stop' }, 'Stop');
  const form = make(
    'form',
    { className: 'try' },
    ...(operation.parameters ?? []).map(fieldOf),
    ...(operation.requestBody ? bodyFields(operation.requestBody) : []),
    make('p', {}, make('button', { className: 'send' }, 'Send request'), ' ', stop),
    output,
  );
  let abort = new AbortController();
  stop.addEventListener('click', () => abort.abort());
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    abort.abort();
    abort = new AbortController();
    const headers = new Headers();
    if (byId('key').value) headers.set('Authorization', `Bearer ${byId('key').value}`);
    let address = path;
    const query = new URLSearchParams();
    for (const { parameter, value } of form.querySelectorAll('.field > :is(input, select)')) {
      if (value === '') continue;
      if (parameter.place === 'path')
        address = address.replace(`{${parameter.name}}`, encodeURIComponent(value));
      else if (parameter.place === 'query') query.append(parameter.name, value);
      else headers.set(parameter.name, value);
    }
    let body;
    if (operation.requestBody) {
      const { media, text, file } = form.elements;
      body = text.parentElement.hidden ? file.files[0] : text.value;
      if (media.value === 'multipart/form-data') {
        const [part] = Object.keys(operation.requestBody.content[media.value].schema.properties);
        const parts = new FormData();
        if (body) parts.append(part, body);
        body = parts; // The browser sets the type, with the boundary.
      } else headers.set('Content-Type', media.value);
    }
    // A proxy may place the server below a path.
    const url = new URL(`.${address}${query.size ? `?${query}` : ''}`, new URL('.', location.href));
    showAnswer(
      output,
      new Request(url, { method: method.toUpperCase(), headers, body, signal: abort.signal }),
    );
  });
  return form;
}

function operationDetails(path, method, operation, tag) {
  const summary = make(
    'summary',
    {},
    make('span', { className: `method ${method}` }, method.toUpperCase()),
    ' ',
    make('code', {}, path),
    ' ',
    make('span', { className: 'says' }, operation.summary),
  );
  const id = `operations-${tag}-${operation.operationId}`;
  return lazy(make('details', { id, className: 'opblock' }, summary), () => [
    make('p', {}, ...prose(operation.description)),
    ...(operation.security?.length === 0 ? [make('p', {}, 'Needs no key.')] : []),
    ...(operation.requestBody
      ? [make('h3', {}, 'Body'), ...content(operation.requestBody.content)]
      : []),
    make('h3', {}, 'Responses'),
    make(
      'dl',
      {},
      ...Object.entries(operation.responses).flatMap(([status, reference]) => {
        const response = resolved(reference);
        return [
          make('dt', {}, make('code', {}, status), ' ', ...prose(response.description)),
          make('dd', {}, ...content(response.content)),
        ];
      }),
    ),
    make('h3', {}, 'Try it'),
    tryForm(path, method, operation),
  ]);
}

byId('version').textContent = openapi.info.version;
byId('introduction').append(...prose(openapi.info.description));
const operations = Object.entries(openapi.paths).flatMap(([path, methods]) =>
  Object.entries(methods).map(([method, operation]) => ({ path, method, operation })),
);
for (const { name, description } of openapi.tags) {
  const own = operations.filter(({ operation }) => operation.tags[0] === name);
  byId('operations').append(
    make(
      'section',
      {},
      make('h2', {}, name),
      make('p', {}, ...prose(description)),
      ...own.map(({ path, method, operation }) => operationDetails(path, method, operation, name)),
    ),
  );
}
byId('schemas').append(...Object.entries(schemas).map(schemaDetails));
const rows = document.querySelector('#problems tbody');
for (const { type, status, title } of openapi['x-problem-types']) {
  const tableRow = rows.insertRow();
  tableRow.id = type.split('#')[1];
  for (const text of [status, title, type]) tableRow.insertCell().textContent = text;
}

byId('tools').addEventListener('submit', (event) => event.preventDefault());
byId('search').addEventListener('input', ({ target }) => {
  const wanted = target.value.toLowerCase();
  for (const details of document.querySelectorAll('.opblock'))
    details.hidden = !details.textContent.toLowerCase().includes(wanted);
  for (const section of document.querySelectorAll('#operations section'))
    section.hidden = !section.querySelector('.opblock:not([hidden])');
});

/** Opens what the address names: an operation, a schema or a problem. */
function reveal() {
  const hash = decodeURIComponent(location.hash.slice(1));
  const [, tag, operation] = hash.split('/'); // #/Jobs/createJob
  const meant = byId(operation ? `operations-${tag}-${operation}` : hash);
  document.querySelector('.meant')?.classList.remove('meant');
  if (!meant) return;
  if (meant.localName === 'details') meant.open = true;
  meant.classList.add('meant');
  meant.scrollIntoView();
}
addEventListener('hashchange', reveal);
reveal();
