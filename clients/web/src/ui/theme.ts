import { theme } from './server_state';

function apply(): void {
  const wish = theme.get();
  if (wish === 'auto') delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = wish;
}

export function followTheme(): void {
  apply();
  theme.subscribe(apply);
}
