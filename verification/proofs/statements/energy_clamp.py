"""The energy clamp makes any candidate change of velocity passive, and keeps as much of it as it may."""

from verification.proofs.algebra import scalar, vector
from verification.proofs.exact import instance
from verification.proofs.facts import NonNegative, equation
from verification.proofs.rewriting import identity, positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor, Term
from verification.proofs.vocabulary import SYMMETRIC_MASS, M, v

# a mass at v = 1 that a wrong solver would send to −3: α = 1/2 sends it to −1
CASE = instance({"M": [[1]], "v": [1], "Δ": [-4]}, α="1/2")


def statement() -> Statement:
    change, alpha, after = vector("Δ", "d"), scalar("α"), vector("v⁺", "d")
    name = equation("the clamped velocity", after, v + alpha * change)
    slack = NonNegative(
        "α is at most −2 (vᵀMΔ)/(ΔᵀMΔ)", -2 * v.T * M * change - alpha * change.T * M * change
    )
    positive = NonNegative("α ≥ 0", alpha)
    rules = (name, name.T)
    swap = (Cofactor(alpha * change.T, SYMMETRIC_MASS, v),)
    loss = identity(
        "twice the loss of kinetic energy",
        v.T * M * v - after.T * M * after,
        alpha * slack.value,
        rules,
        "−2 α vᵀMΔ − α² ΔᵀMΔ, where ΔᵀMv = vᵀMΔ",
        first=swap,
    )
    passive = positivity(
        "the kinetic energy does not grow",
        loss.claim.rhs,
        (Term(1, (positive,), slack),),
        because="a product",
    )
    return Statement(
        name="energy_clamp",
        title="The energy clamp",
        source="docs/theory.md (energy clamp)",
        statement=(
            r"Let $\Delta$ be any candidate change of velocity, and $0 \leq \alpha \leq -2 \, v^\top M "
            r"\Delta / \Delta^\top M \Delta$. Then $v^+ = v + \alpha \Delta$ loses $\frac12 \alpha \, (-2 "
            r"v^\top M \Delta - \alpha \Delta^\top M \Delta) \geq 0$. Where $v^\top M \Delta \geq 0$ there "
            r"is no such $\alpha > 0$, and $\alpha = 0$ is taken."
        ),
        given=(SYMMETRIC_MASS, positive, slack),
        definitions=(name,),
        steps=(loss, passive),
        concludes=(loss.claim.name, passive.claim.name),
        witness=CASE,
        needed=(
            Without(SYMMETRIC_MASS.name, instance({"M": [[1, 1], [0, 1]], "v": [1, 0], "Δ": [0, -1]}, α=1)),
            Without(positive.name, CASE.with_values(α="-1/2")),
            Without(slack.name, CASE.with_values(α=1)),
        ),
        twins=(
            Twin(
                "the candidate may be taken whole",
                NonNegative("KE − KE of v + Δ", v.T * M * v - (v + change).T * M * (v + change)),
                CASE,
                "from 1 to −3: nine times the energy",
            ),
        ),
        remarks=(
            "M need not be definite, and nothing is divided by pᵀWp, which may be zero near the kernel of "
            "Jᵀ.",
            "A clamped impact is passive, not therefore right: what it leaves approaching must be reported.",
        ),
    )
