"""C05: for one approaching contact the paper's impulse is the one solution of the complementarity problem."""

from verification.proofs.algebra import scalar
from verification.proofs.exact import instance
from verification.proofs.facts import NonNegative, equation
from verification.proofs.rewriting import identity, positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cancelling, Cofactor, Positivity, Term
from verification.proofs.vocabulary import E_AT_LEAST_MINUS_ONE, ONE, e

CASE = instance({"γ⁻": -1, "p": 1, "w": 1, "ω": 1}, e=0)


def statement() -> Statement:
    gamma, p, w, omega, slack = (scalar(name) for name in ("γ⁻", "p", "w", "ω", "s"))
    name = equation("slack: γ⁺ + e γ⁻ with γ⁺ = γ⁻ + w p", slack, (1 + e) * gamma + w * p)
    approaching = NonNegative("the contact approaches: γ⁻ ≤ 0", -gamma)
    separated = NonNegative("γ⁺ + e γ⁻ ≥ 0", slack)
    complementary = equation("p (γ⁺ + e γ⁻) = 0", p * slack, 0)
    inverse = equation("ω = 1/w", omega * w, 1)
    positive = NonNegative("w > 0", omega)
    square = Positivity(
        NonNegative("−s² ≥ 0", -(slack * slack)),
        (Term(1, (E_AT_LEAST_MINUS_ONE, approaching, separated)),),
        (Cofactor(-slack, name, ONE), Cofactor(-w, complementary, ONE)),
        "s² = s ((1+e) γ⁻ + w p), and s p = 0",
    )
    tight = Cancelling(
        equation("Newton's law holds: s = 0", slack, 0), square.claim, None, "a square ≤ 0 is 0"
    )
    unique = identity(
        "the impulse is the paper's (19)",
        p,
        -(1 + e) * omega * gamma,
        because="ω w p = ω (s − (1+e) γ⁻)",
        first=(
            Cofactor(-p, inverse, ONE),
            Cofactor(omega, tight.claim, ONE),
            Cofactor(-omega, name, ONE),
        ),
    )
    pushes = positivity(
        "and it pushes", -(1 + e) * omega * gamma, (Term(1, (E_AT_LEAST_MINUS_ONE, approaching, positive)),)
    )
    return Statement(
        name="single_contact_complementarity",
        title="One contact: the impulse of the complementarity problem",
        source="paper V-A; C05",
        statement=(
            r"Let $w = J M^{-1} J^\top > 0$ and $\gamma^- \leq 0$, $e \geq -1$. Whatever $p$ solves "
            r"$\gamma^+ + e \gamma^- \geq 0$, $p \, (\gamma^+ + e \gamma^-) = 0$ with $\gamma^+ = \gamma^- "
            r"+ w p$ is $p = -(1+e) \gamma^- / w$, and it is not negative."
        ),
        given=(approaching, separated, complementary, inverse, positive, E_AT_LEAST_MINUS_ONE),
        definitions=(name,),
        steps=(square, tight, unique, pushes),
        concludes=(tight.claim.name, unique.claim.name, pushes.claim.name),
        witness=CASE,
        needed=(
            Without(
                approaching.name, CASE.with_values({"γ⁻": 1, "p": 0}), "a separating contact needs no impulse"
            ),
            Without(separated.name, CASE.with_values(p=0)),
            Without(complementary.name, CASE.with_values(p=2)),
            Without(inverse.name, CASE.with_values(ω=2)),
            Without(positive.name, CASE.with_values(w=-1, ω=-1, p=-1)),
            Without(E_AT_LEAST_MINUS_ONE.name, CASE.with_values(e=-2, p=0)),
        ),
        twins=(
            Twin(
                "an impulse without the 1 + e",
                equation("p = −e γ⁻/w", p, -e * omega * gamma),
                CASE,
            ),
        ),
        remarks=(r"$p \geq 0$ need not be asked for: it follows.",),
    )
