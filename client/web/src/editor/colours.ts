// One colour for each pair; white text is readable on all of them.
const colours = [
  '#b3261e',
  '#0b57d0',
  '#1e7d32',
  '#8e24aa',
  '#a35200',
  '#00707a',
  '#a8005c',
  '#5a6300',
  '#6d4c41',
  '#3949ab',
  '#006b54',
  '#7a4fbf',
];

export const automaticColour = '#55636e';

export function colourOf(number: number): string {
  return colours[(number - 1) % colours.length]!;
}
