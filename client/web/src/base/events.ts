// What a person entered, of the events of fields.

export function textOf(event: Event): string {
  return (event.target as HTMLInputElement | HTMLSelectElement).value;
}

/** NaN if it is no number. */
export function numberOf(event: Event): number {
  return (event.target as HTMLInputElement).valueAsNumber;
}

export function checkedOf(event: Event): boolean {
  return (event.target as HTMLInputElement).checked;
}
