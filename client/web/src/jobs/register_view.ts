// The form of a registration: source, targets, their points in parameter space, common options.
import { LitElement, css, html, nothing } from 'lit';
import { customElement, state } from 'lit/decorators.js';
import { catalog, type CatalogState } from '../api/catalog.ts';
import { registerFamily } from '../api/changes.ts';
import { ApiError, toApiError } from '../api/errors.ts';
import { shortName } from '../api/names.ts';
import '../base/error_message.ts';
import { checkedOf, textOf } from '../base/events.ts';
import { icons } from '../base/icons.ts';
import { Observing } from '../base/observing.ts';
import { controls } from '../base/styles.ts';
import { Animation_State } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { jobBoard } from './job_board.ts';
import { jobsStyles } from './jobs_styles.ts';
import {
  emptyForm,
  faultOf,
  requestOf,
  type Member,
  type RegisterForm,
} from './register_request.ts';

const maxParameters = 4;

/** Tells of a registration that began by the event `registered`. */
@customElement('lb-register')
export class RegisterView extends LitElement {
  static override styles = [
    controls,
    jobsStyles,
    css`
      form { display: grid; gap: 16px; }
      td { vertical-align: middle; }
      td select { width: 100%; min-width: 140px; }
      td input, th input { width: 110px; }
      th:first-child { width: 76px; }
      td:last-child { width: 52px; }
      .role { color: var(--muted); white-space: nowrap; }
      fieldset { border: 0; margin: 0; padding: 0; min-width: 0; display: grid; gap: 10px; }
      legend { padding: 0; font-weight: 600; margin-bottom: 8px; }
      details .fields { margin-top: 12px; }
    `,
  ];

  @state() private lists: CatalogState = catalog.value;
  @state() private form: RegisterForm = emptyForm();
  @state() private error: ApiError | undefined;
  @state() private sending = false;
  readonly observing = new Observing(this, () => catalog, (lists) => (this.lists = lists));

  private get ready(): string[] {
    return this.lists.animations
      .filter(({ state }) => state === Animation_State.READY)
      .map(({ name }) => name);
  }

  override render() {
    const { form } = this;
    if (this.ready.length < 2) {
      return html`<p class="card empty">A family needs at least two animations. Upload them
        first.</p>`;
    }
    return html`
      <form class="card" @submit=${this.onSubmit}>
        <label class="field">Name of the family
          <input required maxlength="63" autocomplete="off" spellcheck="false" .value=${form.family}
            @input=${(event: Event) => this.patch({ family: textOf(event) })} />
        </label>
        ${this.renderMembers()} ${this.renderChoices()}
        <lb-error .error=${this.error}></lb-error>
        <div class="actions"><button class="primary"
          ?disabled=${this.sending}>Register</button></div>
      </form>
    `;
  }

  private renderMembers() {
    const { parameters, members } = this.form;
    return html`
      <fieldset>
        <legend>Animations</legend>
        <div class="scroll">
          <table>
            <thead>
              <tr>
                <th scope="col">Role</th>
                <th scope="col">Animation</th>
                ${parameters.map(
                  (name, i) => html`<th scope="col">${this.renderParameter(name, i)}</th>`,
                )}
                <td></td>
              </tr>
            </thead>
            <tbody>${members.map((member, index) => this.renderMember(member, index))}</tbody>
          </table>
        </div>
        <div class="actions">
          <button type="button" @click=${this.addTarget}>Add a target</button>
          <button type="button" ?disabled=${parameters.length >= maxParameters}
            @click=${this.addParameter}>
            Add a parameter
          </button>
        </div>
        <p class="hint">Blends go from the source towards the targets. With parameters, such as the
          width of a wall,
          frames can be asked for by a point between the animations: give each its values.</p>
      </fieldset>
    `;
  }

  private renderParameter(name: string, index: number) {
    return html`<input aria-label=${`Name of parameter ${index + 1}`} placeholder="name"
      maxlength="63" spellcheck="false"
      .value=${name} @input=${(event: Event) => this.setParameter(index, textOf(event))} />`;
  }

  private renderMember({ animation, values }: Member, index: number) {
    const role = index ? `Target ${index}` : 'Source';
    const choose = (event: Event) => this.setMember(index, { animation: textOf(event), values });
    return html`<tr>
      <td class="role">${role}</td>
      <td>
        <select aria-label=${role} @change=${choose}>
          <option value="" .selected=${!animation}>choose</option>
          ${this.ready.map(
            (name) =>
              html`<option value=${name}
                .selected=${name === animation}>${shortName(name)}</option>`,
          )}
        </select>
      </td>
      ${this.form.parameters.map(
        (name, i) => html`<td>
        <input inputmode="decimal"
          aria-label=${`${name || `Parameter ${i + 1}`} of ${role.toLowerCase()}`}
          .value=${values[i] ?? ''}
            @input=${(event: Event) => this.setValue(index, i, textOf(event))} />
      </td>`,
      )}
      <td>
        ${
          index > 0 && this.form.members.length > 2
            ? html`<button type="button" aria-label=${`Remove target ${index}`}
              @click=${() => this.removeMember(index)}>
              ${icons.close}
            </button>`
            : nothing
        }
      </td>
    </tr>`;
  }

  private renderChoices() {
    const { form } = this;
    return html`
      <details>
        <summary>Options</summary>
        <div class="fields">
          <label class="field">Iterations
            <input type="number" min="1" max="200" placeholder="20" .value=${form.iterations}
              @input=${(event: Event) => this.patch({ iterations: textOf(event) })} />
            <span class="hint">fewer than 8 make a preview</span>
          </label>
          <label class="field">How times blend
            <select @change=${this.choose('timeBlending')}>
              ${this.choice('AUTOMATIC', 'as the animations show', form.timeBlending)}
              ${this.choice('LINEAR', 'as positions do', form.timeBlending)}
              ${this.choice('SQUARES', 'as falls from rest', form.timeBlending)}
            </select>
          </label>
          ${
            form.timeBlending === 'SQUARES'
              ? html`<label class="field">Rest time, s
                <input type="number" min="-3600" max="0" step="any" placeholder="0"
                  .value=${form.restTime}
                  @input=${(event: Event) => this.patch({ restTime: textOf(event) })} />
                <span class="hint">when gravity began to move what was at rest</span>
              </label>`
              : nothing
          }
          ${
            form.parameters.length
              ? html`<label class="field">Between the points
                <select @change=${this.choose('interpolation')}>
                  ${this.choice('LINEAR', 'linear, in triangles', form.interpolation)}
                  ${this.choice('SMOOTH', 'smooth, through all', form.interpolation)}
                </select>
              </label>`
              : nothing
          }
          <label class="field">Publish only if
            <select @change=${this.choose('requiredGrade')}>
              ${this.choice('', 'whatever the verdict', form.requiredGrade)}
              ${this.choice('DOUBTFUL', 'not too different', form.requiredGrade)}
              ${this.choice('GOOD', 'good', form.requiredGrade)}
            </select>
          </label>
          <label class="check">
            <input type="checkbox" .checked=${form.automatic}
              @change=${(event: Event) => this.patch({ automatic: checkedOf(event) })} />
            Find pairs by itself
          </label>
          <label class="check">
            <input type="checkbox" .checked=${form.replace}
              @change=${(event: Event) => this.patch({ replace: checkedOf(event) })} />
            New version of a family that is there
          </label>
        </div>
      </details>
    `;
  }

  private choice(value: string, text: string, current: string) {
    return html`<option value=${value} .selected=${value === current}>${text}</option>`;
  }

  private choose(field: 'timeBlending' | 'interpolation' | 'requiredGrade') {
    return (event: Event) => this.patch({ [field]: textOf(event) });
  }

  private patch(change: Partial<RegisterForm>): void {
    this.form = { ...this.form, ...change };
  }

  private setMember(index: number, member: Member): void {
    this.patch({ members: this.form.members.map((old, i) => (i === index ? member : old)) });
  }

  private setValue(index: number, parameter: number, text: string): void {
    const { animation, values } = this.form.members[index]!;
    const all = this.form.parameters.map((_, i) => (i === parameter ? text : (values[i] ?? '')));
    this.setMember(index, { animation, values: all });
  }

  private setParameter(index: number, text: string): void {
    this.patch({
      parameters: this.form.parameters.map((old, i) => (i === index ? text.trim() : old)),
    });
  }

  private addTarget(): void {
    this.patch({ members: [...this.form.members, { animation: '', values: [] }] });
  }

  private removeMember(index: number): void {
    this.patch({ members: this.form.members.filter((_, i) => i !== index) });
  }

  // A name that is emptied again is left out when it is sent.
  private addParameter(): void {
    this.patch({ parameters: [...this.form.parameters, ''] });
  }

  private withoutEmpty(): RegisterForm {
    const used = this.form.parameters.map((name, i) => (name ? i : -1)).filter((i) => i >= 0);
    return {
      ...this.form,
      parameters: used.map((i) => this.form.parameters[i]!),
      members: this.form.members.map((member) => ({
        ...member,
        values: used.map((i) => member.values[i] ?? ''),
      })),
    };
  }

  private async onSubmit(event: Event): Promise<void> {
    event.preventDefault();
    const form = this.withoutEmpty();
    const fault = faultOf(form);
    this.error = fault ? new ApiError(400, fault) : undefined;
    if (!fault && !this.sending) await this.send(form);
  }

  private async send(form: RegisterForm): Promise<void> {
    this.sending = true;
    try {
      jobBoard.add(await registerFamily(requestOf(form)));
      this.form = emptyForm();
      this.dispatchEvent(new CustomEvent('registered'));
    } catch (error) {
      this.error = toApiError(error);
    }
    this.sending = false;
  }
}
