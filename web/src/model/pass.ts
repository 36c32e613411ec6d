/** The visitor's right to come in: the token of an invitation, or of a session that it began. */

export interface Pass {
  /** To be said first; without one where there is none. */
  readonly token: string | undefined;
  /** The server has begun a session, with this token. */
  keep(session: string): void;
  /** The server does not take the session's token: whether the invitation is left to try. */
  forget(): boolean;
}
