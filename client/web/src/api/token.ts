// The token that a person typed: kept for this tab's session only, never in a URL.
import { Observable } from '../base/observable.ts';

const key = 'liquidblend.token';

function stored(): string {
  try {
    return sessionStorage.getItem(key) ?? '';
  } catch {
    return ''; // storage is switched off
  }
}

export const token = new Observable<string>(stored());

export function setToken(value: string): void {
  try {
    if (value) sessionStorage.setItem(key, value);
    else sessionStorage.removeItem(key);
  } catch {
    // Then the token lives as long as the page.
  }
  token.set(value);
}

export function authorization(): Record<string, string> {
  return token.value ? { Authorization: `Bearer ${token.value}` } : {};
}

/** WebSocket subprotocols; browsers cannot set headers there. None without a token. */
export function subprotocols(value: string): string[] {
  return value ? ['liquidblend.v1', `liquidblend.bearer.${base64Url(value)}`] : [];
}

export function base64Url(text: string): string {
  const bytes = new TextEncoder().encode(text);
  const binary = Array.from(bytes, (byte) => String.fromCharCode(byte)).join('');
  return btoa(binary).replaceAll('+', '-').replaceAll('/', '_').replace(/=+$/, '');
}
