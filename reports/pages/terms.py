"""The terms of the report and what they mean. Every page lists the terms that it uses, under "Terms on this page".

Each term is defined here only. A definition may use other terms; the page then lists these, too.
"""

from __future__ import annotations

import re
from html import unescape

from markupsafe import Markup

from reports.pages.formulas import prose

# A pattern for the words that name the term -> the term as listed, and its meaning.
TERMS: dict[str, tuple[str, str]] = {
    r"worlds?": ("world", "a contact law together with a coupling between device and tool. The same scene is "
                 "simulated in several worlds, each with its name"),
    r"engine": ("engine", "the simulator of this project, iapb; other engines are named"),
    r"IAPB": ("IAPB", "impulse-augmented penalties, the paper's method: an impulse at each new contact, then a spring "
              "and damper while the contact lasts. The world IAPB has this contact law and the four-channel coupling"),
    r"ideal|rigid world": ("ideal", "the world with rigid contacts, computed from a complementarity problem in every "
                           "step, and the four-channel coupling; the reference for a wall that feels rigid"),
    r"PB": ("PB", "penalty-based: the world with springs and dampers as contacts, no impulses, and the four-channel "
            "coupling"),
    r"CBuc": ("CBuc", "constraint-based, with unilateral coupler: the world with rigid contacts in which a spring and "
              "damper join device and tool, active only in contact"),
    r"(?:IAPB|ideal)[- ](?:with )?friction": ("IAPB-friction, ideal-friction",
                                              "the same worlds with Coulomb friction in their impacts or constraints"),
    r"PB, stiffened": ("PB, stiffened", "PB with walls as stiff as the time step permits; other PB has the paper's "
                       "1000 N/m"),
    r"IAPB-push": ("IAPB-push", "the world IAPB with impulses that only push (Poisson's law: a complementarity "
                   "problem for the compression, and one for the rebound)"),
    r"IAPB LM": ("IAPB LM", "IAPB with each impulse spread over several steps, to stay within the device's limits"),
    r"four[- ]channels?": ("four-channel coupling", "device and tool exchange both positions and both forces, so that "
                           "the hand feels the contact force directly"),
    r"unilateral coupler": ("unilateral coupler", "a spring and damper between device and tool, active only while the "
                            "tool is in contact; the hand feels the wall through it"),
    r"penalt(?:y|ies)": ("penalty", "the force of a spring and damper at a contact, which grows with the overlap of "
                         "the two bodies"),
    r"tool": ("tool", "the virtual body that the hand moves through the haptic device"),
    r"virtual walls?|[0-9]+ walls": ("wall", "a fixed virtual obstacle; a count of walls counts combinations of "
                                     "stiffness and damping"),
    r"coordinates": ("coordinates", "the generalized coordinates of a scene; their number d is the size of the mass "
                     "matrix M"),
    r"rows?": ("row", "one line of the contact Jacobian J. The row times the generalized velocity v is the velocity at "
               "one contact along its normal"),
    r"redundant": ("redundant", "a row (or its contact) that is a linear combination of the other rows of the impact. "
                   "Redundant rows make the impulses ambiguous, but not the velocity after the impact"),
    r"rank": ("rank", "the number of linearly independent rows"),
    r"patch": ("patch", "contacts on one face of one body; at most three of their rows are independent"),
    r"piles?": ("pile", "many bodies that lie on each other; most of their contact rows are independent"),
    r"restitution|e = [0-9.]+": ("restitution e", "the ratio of separating to approaching speed at a contact. The "
                                 "equation v_n⁺ = −e v_n⁻ is the restitution law; the restitution residual is the "
                                 "largest error in this equation"),
    r"kinetic metric": ("kinetic metric", "the length √(vᵀ M v) of a velocity v; half of its square is the kinetic "
                        "energy"),
    r"[vu]⁻|[vu]⁺|KE[⁻⁺]|γ[⁻⁺]": ("superscripts − and +", "before (−) and after (+) an impact; v is the velocity, "
                                  "KE the kinetic energy, γ the normal velocities at the contacts"),
    r"κ": ("κ", "the condition number of a matrix: how much it amplifies relative errors"),
    r"ε": ("ε", "the relative spacing of doubles, 2⁻⁵² = 2.2e-16"),
    r"passiv\w+": ("passive", "adds no energy. Impact: the kinetic energy does not rise. Motion: the stored energy "
                     "never exceeds that at the start plus the work done on it"),
    r"factored": ("factored", "the engine's method for one impact: it factors M and projects the velocity with an "
                  "orthonormal basis of the rows"),
    r"(?:no|without|the) clamp": ("clamp", "the last operation of an impact: it moves v⁺ by a few units in the last "
                                  "place until the exact energy is not above that before the impact; if no such v⁺ "
                                  "is found, it shortens v⁺ − v⁻, at worst to zero"),
    r"printed formula|printed, numpy|as printed": ("printed formula", "equation (21) of the paper as it stands, "
                                                   "v⁺ = v⁻ − (1 + e) M⁻¹Jᵀ W† J v⁻ with W = J M⁻¹Jᵀ and "
                                                   "its pseudo-inverse W†, in numpy"),
    r"gram_pinv|gram_cholesky|damped|svd": ("gram_pinv, gram_cholesky, damped, svd", "other methods for the same "
                                            "impact: the printed formula, the Cholesky factor of W, the inverse of W "
                                            "with a little added to its diagonal, and the singular values of J"),
    r"anytime|stop(?:s|ped) early": ("stopped early", "the impact ends when its budget of rows or time is used up, "
                                     "with the rows resolved so far"),
    r"(?:Newton )?LCPs?|complementarity": ("LCP", "linear complementarity problem: impulses only push (p ≥ 0). A "
                                           "contact with an impulse separates exactly as fast as the restitution law "
                                           "says; a contact without one may separate faster"),
    r"NCP|CCP": ("NCP, CCP", "complementarity problems with Coulomb's friction cone: the law itself, and its convex "
                 "relaxation"),
    r"Delassus|W": ("Delassus matrix W", "J M⁻¹ Jᵀ, the inverse mass that the contacts feel"),
    r"trials?": ("trial", "one tested condition of a claim: the claim holds there, fails, or the trial cannot tell "
                  "(the values differ by less than their error)"),
    r"coherence|clustering|filters?": ("coherence, clustering", "the paper's two filters against false collisions. "
                                       "Coherence: a contact that moved less than the coherence distance in a step is "
                                       "the same contact and gets no impulse. Clustering: near contacts merge"),
    r"[Ss]aturat\w+": ("saturated, scaled, spread", "impulses beyond the device's limits: each component cut at "
                      "its limit, all multiplied by one factor, or the rest given in later steps"),
    r"energy exchanged": ("energy exchanged", "the largest of kinetic energy, range of potential energy, and work of "
                          "hand and of coupling"),
    r"event[- ]driven|event by event": ("event-driven", "the exact motion between impacts, with each impact located "
                                        "in time"),
    r"Colgate(?:'s)? (?:passivity )?(?:bound|condition)": ("Colgate's condition", "device damping b ≥ K T/2 + |B|, or "
                                            "K ≤ 2 (b − |B|)/T: a wall of stiffness K and damping B, read every T "
                                            "seconds, is then passive"),
    r"planted": ("planted fault", "an error put into the code on purpose, to show that the check finds it"),
    r"peg": ("peg", "the paper's example: a rectangular body, moved by the hand in a plane, that meets a corner or a "
             "hole"),
}  # fmt: skip
# Heading of a column in the tables of numbers -> what is printed instead, where the key alone does not say enough.
HEADINGS: dict[str, str] = {
    "most contacts that agree": "largest pile that agrees [contacts]",
    "negative share of p": "pulling impulses / sum of |p|",
    "median distance from the LCP": "median distance of (21) from the LCP",
    "pushing from the LCP": "largest distance of pushing impulses from the LCP",
    "contradicted by least squares": "piles where a second test (least squares) disagrees",
    "largest change of KE": "largest (KE⁺ − KE⁻)/KE⁻",
    "smallest fault seen": "smallest error detected",
    "M Δv − impulse": "error of M Δv = impulse", "Jᵀp − impulse": "error of Jᵀp = impulse",
    "restitution": "error of restitution", "decades": "log₁₀ of the ratio", "ratio": "ratio of times",
    "leak / energy exchanged": "leak / twice the dissipation of a damper KT/2 + |B|",
    "with the coordination's gains [N s/m]": "KT/2 + |B| of wall and coupling together [N s/m]",
    "needed / bound": "damping needed / KT/2 + |B|", "drift [m]": "largest distance from the start [m]",
    "creep [m]": "movement in the second half [m]", "position": "position error [body lengths]",
    "energy": "energy error", "signed energy": "energy error, simulated − true",
    "tenfold accuracy costs": "factor in time for 10× smaller error", "error stays": "scenes where the error does not "
    "fall",
    "least error": "smallest error (median of scenes)", "scenes fitted": "scenes with a fit",
    "most exact there": "smallest error at which it is best", "least exact there": "largest error at which it is best",
    "cut short [scenes]": "scenes with finer steps too slow", "passive up to [N s/m]": "largest passive damping B [N "
    "s/m]",
    "there": "exponent there", "MuJoCo's form": "MuJoCo's shapes", "velocities": "joint velocities",
}  # fmt: skip
PLACE = "<!-- terms -->"
_NOT_READ = re.compile(r"<(script|style|nav|head)\b.*?</\1>|<[^>]*>", re.DOTALL)
_PATTERNS = {form: re.compile(rf"(?<![\w-])(?:{form})(?![\w-])") for form in TERMS}


def readable(page: str) -> str:
    """Return what a reader of an HTML page sees: its text, without tags, script, style and navigation."""
    return " ".join(unescape(_NOT_READ.sub(" ", page)).split())


def terms_of(text: str) -> tuple[str, ...]:
    """Return the patterns of the terms in a text and in the meanings of these terms, in the order of TERMS."""
    found: set[str] = set()
    fresh = text
    while fresh:
        new = [form for form, pattern in _PATTERNS.items() if form not in found and pattern.search(fresh)]
        found.update(new)
        fresh = " ".join(" ".join(TERMS[form]) for form in new)
    return tuple(form for form in TERMS if form in found)


def explained(page: str) -> str:
    """Return a page with the list of its terms at PLACE."""
    listed = [TERMS[form] for form in terms_of(readable(page))]
    lines = Markup("").join(Markup("<dt>{}</dt><dd>{}</dd>\n").format(term, prose(said)) for term, said in listed)
    block = f'<details class="numbers terms"><summary>Terms on this page</summary>\n<dl>\n{lines}</dl>\n</details>'
    return page.replace(PLACE, block if listed else "", 1)
