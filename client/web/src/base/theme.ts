// Dark or light: as the system has it, until the person chooses.
import { Observable } from './observable.ts';

export type Theme = 'light' | 'dark';

const key = 'liquidblend.theme';
const system = matchMedia('(prefers-color-scheme: dark)');

function chosen(): Theme | undefined {
  try {
    const value = localStorage.getItem(key);
    return value === 'light' || value === 'dark' ? value : undefined;
  } catch {
    return undefined;
  }
}

function fromSystem(): Theme {
  return system.matches ? 'dark' : 'light';
}

export const theme = new Observable<Theme>(chosen() ?? fromSystem());

export function setTheme(value: Theme): void {
  try {
    localStorage.setItem(key, value);
  } catch {
    // Then the choice lives as long as the page.
  }
  theme.set(value);
}

/** Shows a theme without keeping it, as a link asks for it. */
export function showTheme(value: Theme): void {
  if (value !== theme.value) theme.set(value);
}

function apply(value: Theme): void {
  document.documentElement.dataset.theme = value;
}

export function followTheme(): void {
  apply(theme.value);
  theme.subscribe(apply);
  system.addEventListener('change', () => {
    if (!chosen()) theme.set(fromSystem());
  });
}
