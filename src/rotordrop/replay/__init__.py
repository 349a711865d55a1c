"""The paper's open-loop replay of a recorded drop."""
