/** The visitor's access token: that of an invitation, or of the session that the invitation began. */

export interface Pass {
  /** Token for the first message; undefined where there is none. */
  readonly token: string | undefined;
  /** Store the token of the session that the server has begun. */
  keep(session: string): void;
  /** Drop the session's token, which the server refused; returns whether the invitation is left to try. */
  forget(): boolean;
}
