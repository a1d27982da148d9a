import { LitElement } from 'lit'; import { customElement } from 'lit/decorators.js'; @customElement('lb-editor') export class Editor extends LitElement {}
