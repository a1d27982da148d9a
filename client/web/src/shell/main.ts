// Where the page begins.
import { followTheme } from '../base/theme.ts';
import './page_element.ts';

followTheme();
