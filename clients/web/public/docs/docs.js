// Shows the server's OpenAPI document with Swagger UI, and below it the types of problems.
const dark = matchMedia('(prefers-color-scheme: dark)');
const follow = () => document.documentElement.classList.toggle('dark-mode', dark.matches);
dark.addEventListener('change', follow);
follow();

const openapi = await (await fetch('openapi.json')).json();
// A proxy may place the server below a path.
openapi.servers = [{ url: new URL('.', location.href).pathname.replace(/\/$/, '') || '/' }];
const rows = document.querySelector('#problems tbody');
for (const { type, status, title } of openapi['x-problem-types']) {
  const row = rows.insertRow();
  row.id = type.split('#')[1];
  for (const text of [status, title, type]) row.insertCell().textContent = text;
}
// A link to a problem type shows it at the top, where content that loads later does not move it.
const meant = document.getElementById(location.hash.slice(1));
if (meant?.closest('#problems')) {
  document.querySelector('main').prepend(document.getElementById('problems'));
  meant.classList.add('meant');
  meant.scrollIntoView();
}
// Long blocks of code scroll; Swagger UI does not include them in the tab order.
const blocks = '#reference pre, #reference .highlight-code > *';
const addToTabOrder = () => {
  for (const block of document.querySelectorAll(blocks)) {
    const scrolls =
      block.scrollWidth > block.clientWidth + 1 || block.scrollHeight > block.clientHeight + 1;
    if (block.tabIndex === 0 || !scrolls) continue;
    block.tabIndex = 0;
    block.setAttribute('role', 'region');
    block.setAttribute('aria-label', 'Code');
  }
};
new MutationObserver(() => requestAnimationFrame(addToTabOrder)).observe(
  document.getElementById('reference'),
  { childList: true, subtree: true },
);
globalThis.SwaggerUIBundle({
  spec: openapi,
  dom_id: '#reference',
  deepLinking: true,
  tryItOutEnabled: true,
  defaultModelsExpandDepth: 0,
  validatorUrl: null,
});
